#include "tests/system/skills.hpp"

#include <fmt/format.h>

#include <memory>
#include <utility>

#include "pons/skills/conduct.hpp"
#include "tests/system/hand.hpp"

namespace pons::tests {
namespace {

using skills::Cell;
using task::Json;
using task::Progress;
using task::Status;

constexpr double kOverRim_m = 0.25;
constexpr Duration kToldWithin = std::chrono::milliseconds(30);  // from here to the cups
constexpr Duration kSealsWithin = std::chrono::milliseconds(400), kOpensWithin = std::chrono::milliseconds(600);
constexpr double kInside_m = 0.02;
constexpr Duration kComesWithin = std::chrono::seconds(20);
constexpr Duration kPrints = std::chrono::milliseconds(300);

// What both arm skills need.
class ByArm : public skills::ArmSkill {
 public:
  ByArm(Cell& cell, Steps& steps) : cell_(cell), hand_(cell, steps) {}
  void cancel(Time now) override {
    cancelled_ = true;
    if (cell_.arm.operational() && now < cell_.arm.motion_end()) (void)cell_.arm.stop(now);
  }

 protected:
  Cell& cell_;
  Hand hand_;
  bool cancelled_ = false;
};

class Pick final : public ByArm {
 public:
  Pick(Cell& cell, Plant& plant, Steps& steps, std::string object)
      : ByArm(cell, steps), plant_(plant), object_(std::move(object)), lay_down_(cell, steps) {}

  Progress tick(Time now) override {
    if (!cell_.arm.operational()) {
      phase_ = cell_.held ? Phase::kLift : Phase::kSeek;
      return cancelled_ ? Progress{Status::kFailed, "cancelled"} : Progress{};
    }
    // What it has taken hold of is lifted free of the belt first.
    const bool lifts_it = cell_.held && cell_.held->code == object_ && phase_ == Phase::kLift;
    if (cancelled_ && !lifts_it) {
      if (phase_ == Phase::kGrip && !cell_.held) hand_.vacuum(false);
      return {Status::kFailed, cell_.held ? "cancelled; still held" : "cancelled"};
    }
    if (cell_.held && cell_.held->code != object_) {
      lay_down_.tick(now);  // what a task that was broken off has left
      return {};
    }
    switch (phase_) {
      case Phase::kSeek:
        return seek(now);
      case Phase::kReach:
        return reach(now);
      case Phase::kGrip:
        return grip(now);
      case Phase::kLift:
        return lift(now);
    }
    return {Status::kFailed, "unreachable"};
  }
  void cancel(Time now) override {
    cancelled_ = true;
    if (phase_ != Phase::kLift) ByArm::cancel(now);
  }
  bool may_rest(Time, task::Pause pause) override {
    if ((cell_.held && cell_.held->code != object_) || phase_ == Phase::kGrip ||
        (pause == task::Pause::kHandOver && cell_.held))
      return false;
    phase_ = cell_.held ? Phase::kLift : Phase::kSeek;
    lifts_ = false;
    return true;
  }
  void go_on(Time, Duration) override { seeks_since_.reset(); }

 private:
  enum class Phase : std::uint8_t { kSeek, kReach, kGrip, kLift };

  Progress seek(Time now) {
    if (cell_.held) return begin_lift();
    const auto seen = plant_.top_of(object_);
    if (!seen) return {Status::kFailed, "it is not on the belt"};
    const Vector3& top = *seen;
    const world::Belt& belt = cell_.world.belt;
    if (top.x() > belt.pick_x_max_m) return {Status::kFailed, "it has ridden past"};
    if (!seeks_since_) seeks_since_ = now;
    if (top.x() < belt.pick_x_min_m + kInside_m)
      return now < *seeks_since_ + kComesWithin ? Progress{} : Progress{Status::kFailed, "it does not come"};
    cell_.hold_belt(now);
    if (cell_.belt_speed_m_s() > 0) return {};
    if (!hand_.go(now, top)) return {Status::kFailed, "no way to it"};
    phase_ = Phase::kReach;
    return {};
  }
  Progress reach(Time now) {
    cell_.hold_belt(now);
    if (!hand_.arrived(now)) return {};
    hand_.vacuum(true);
    since_ = now;
    phase_ = Phase::kGrip;
    return {};
  }
  Progress grip(Time now) {
    cell_.hold_belt(now);
    if (cell_.arm.cups().phase == link::VacuumPhase::kSealed) {
      const skills::Load load{.size_m = {kParcelLength_m, kParcelWidth_m, kParcelHeight_m}};
      cell_.held = skills::Held{.code = object_, .load = load, .falls = cell_.falls()};
      return begin_lift();
    }
    if (now < since_ + kSealsWithin) return {};
    hand_.vacuum(false);
    return {Status::kRetry, "missed it"};
  }
  Progress begin_lift() {
    phase_ = Phase::kLift;
    lifts_ = false;
    return {};
  }
  Progress lift(Time now) {
    if (!cell_.held) return begin_again();
    if (cell_.arm.cups().phase != link::VacuumPhase::kSealed) {
      hand_.vacuum(false);
      cell_.holds_nothing();
      return {Status::kRetry, "lost it on the way up"};
    }
    if (!std::exchange(lifts_, true) && !hand_.rise(now)) return {Status::kFailed, "no way up"};
    if (!hand_.arrived(now)) return {};
    cell_.weighs(kParcelMass_kg);
    if (cancelled_) return {Status::kFailed, "cancelled; still held"};
    return {Status::kSucceeded, {}, {{"mass_kg", kParcelMass_kg}}};
  }
  Progress begin_again() {
    phase_ = Phase::kSeek;
    return {};
  }

  const Plant& plant_;
  const std::string object_;
  LayDown lay_down_;
  Phase phase_ = Phase::kSeek;
  std::optional<Time> seeks_since_;
  Time since_;
  bool lifts_ = false;
};

class Place final : public ByArm {
 public:
  Place(Cell& cell, Steps& steps, std::string place, std::string object)
      : ByArm(cell, steps), place_(std::move(place)), object_(std::move(object)) {}

  Progress tick(Time now) override {
    if (phase_ == Phase::kLetGo) return let_go(now);
    if (!cell_.held) return missing();
    if (cell_.held->code != object_) return {Status::kFailed, fmt::format("the cups hold {}", cell_.held->code)};
    if (!cell_.arm.operational()) {
      phase_ = Phase::kSetOut;
      return cancelled_ ? Progress{Status::kFailed, "cancelled; still held"} : Progress{};
    }
    if (cancelled_) return {Status::kFailed, "cancelled; still held"};
    if (cell_.arm.cups().phase != link::VacuumPhase::kSealed) {
      hand_.vacuum(false);
      cell_.holds_nothing();
      return {Status::kFailed, "lost it on the way"};
    }
    if (phase_ == Phase::kSetOut) {
      Vector3 over = cell_.world.place(place_)->center_m;
      over.z() += kOverRim_m;
      if (!hand_.go(now, over)) return {Status::kFailed, "no way there"};
      phase_ = Phase::kCarry;
      return {};
    }
    if (!hand_.arrived(now)) return {};
    hand_.vacuum(false);
    since_ = now;
    phase_ = Phase::kLetGo;
    return {};
  }
  void cancel(Time now) override {
    if (phase_ == Phase::kLetGo) return;
    ByArm::cancel(now);
  }
  bool may_rest(Time, task::Pause pause) override {
    if (pause == task::Pause::kHandOver || phase_ == Phase::kLetGo) return false;
    phase_ = Phase::kSetOut;
    return true;
  }
  void go_on(Time, Duration) override {}

 private:
  enum class Phase : std::uint8_t { kSetOut, kCarry, kLetGo };

  // Let go of, or lost, in a stop.
  Progress missing() {
    const bool was_held = cell_.lost && cell_.lost->code == object_;
    const auto chutes = was_held ? cell_.mouths.fallen_since(cell_.lost->falls) : std::vector<const world::Place*>{};
    if (chutes.empty()) return {Status::kFailed, "nothing is held"};
    if (chutes.back()->name == place_) return {Status::kSucceeded};
    return {Status::kException, "fell into " + chutes.back()->name};
  }

  // The cups are off, through every stop: what is over the mouth falls in.
  Progress let_go(Time now) {
    if (cell_.arm.state().vacuum_on != 0 && now > since_ + kToldWithin) {
      phase_ = Phase::kSetOut;  // a stop came before the word did
      return {};
    }
    if (!cell_.arm.cups().open || cell_.arm.state().vacuum_on != 0) {
      return now < since_ + kOpensWithin ? Progress{} : Progress{Status::kFailed, "it does not come off"};
    }
    if (cell_.held) cell_.holds_nothing();
    return {Status::kSucceeded};
  }

  const std::string place_, object_;
  Phase phase_ = Phase::kSetOut;
  Time since_;
};

// Tells the printer once, in its second tick, and waits until that has printed.
class Print final : public task::Skill {
 public:
  Print(Plant& plant, Steps& steps, std::string task, int number)
      : plant_(plant), steps_(steps), task_(std::move(task)), number_(number) {}

  Progress tick(Time now) override {
    if (told_) return now < *told_ + kPrints ? Progress{} : Progress{Status::kSucceeded};
    if (ends_) return {Status::kFailed, "broken off", Json::object(), {}, task::StopResult::kConfirmed};
    if (pauses_) return {Status::kPaused, {}, Json::object(), {}, task::StopResult::kConfirmed};
    if (!std::exchange(begun_, true)) return {};
    if (steps_.at(Act::kPrint, Moment::kBefore)) plant_.print(task_, number_);
    (void)steps_.at(Act::kPrint, Moment::kAfter);
    told_ = now;
    return {};
  }
  void pause(Time, task::Pause) override { pauses_ = true; }
  void resume(Time) override { pauses_ = false; }
  void cancel(Time) override { ends_ = true; }
  void halt(Time) override { ends_ = true; }

 private:
  Plant& plant_;
  Steps& steps_;
  const std::string task_;
  const int number_;
  std::optional<Time> told_;
  bool begun_ = false, ends_ = false, pauses_ = false;
};

// All arguments are needed.
Json schema_of(const Json& properties) {
  Json schema{{"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
  for (const auto& [name, type] : properties.items()) schema["required"].push_back(name);
  return schema;
}

const Json kText{{"type", "string"}}, kNumber{{"type", "integer"}};

}  // namespace

void add_skills(task::SkillRegistry& registry, Cell& cell, Plant& plant, Steps& steps) {
  const auto begins = [&steps] { (void)steps.at(Act::kStart, Moment::kBefore); };
  registry.add({.name = "pick",
                .summary = "takes a parcel off the belt",
                .schema = schema_of({{"object", kText}}),
                .resources = {"arm"},
                .timeout = std::chrono::seconds(120),
                .attempts = 3,
                .outputs = {"mass_kg"},
                .safe_points = {"before it takes hold", "when it holds it"},
                .start = [&cell, &plant, &steps, begins](const Json& arguments, Time) {
                  begins();
                  auto skill = conduct(
                      cell, std::make_unique<Pick>(cell, plant, steps, arguments.at("object").get<std::string>()));
                  (void)steps.at(Act::kStart, Moment::kAfter);
                  return skill;
                }});
  registry.add({.name = "place",
                .summary = "lets go of it over a chute",
                .schema = schema_of({{"place", kText}, {"object", kText}}),
                .resources = {"arm"},
                .timeout = std::chrono::seconds(60),
                .safe_points = {"on the way"},
                .start = [&cell, &steps, begins](const Json& arguments, Time) {
                  begins();
                  return conduct(cell, std::make_unique<Place>(cell, steps, arguments.at("place").get<std::string>(),
                                                               arguments.at("object").get<std::string>()));
                }});
  registry.add({.name = "print",
                .summary = "prints once",
                .schema = schema_of({{"task", kText}, {"number", kNumber}}),
                .resources = {"printer"},
                .timeout = std::chrono::seconds(30),
                .safe_points = {"before it prints"},
                .start = [&plant, &steps, begins](const Json& arguments, Time) -> std::unique_ptr<task::Skill> {
                  begins();
                  return std::make_unique<Print>(plant, steps, arguments.at("task").get<std::string>(),
                                                 arguments.at("number").get<int>());
                }});
}

}  // namespace pons::tests
