#include "pons/skills/press.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pons/skills/conduct.hpp"
#include "pons/skills/grasp.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr double kOver_m = 0.03;                                // from where the arm feels its way down
constexpr double kComeDown_m_s = 0.03;                          // there
constexpr double kLeastDamping_ns_m = 600;                      // stiffer bellows than that make a softer arm swing
constexpr double kAcross_n_m = 2000, kAcross_ns_m = 400;        // it stays over the place,
constexpr double kUpright_nm_rad = 100, kUpright_nms_rad = 10;  // and upright
constexpr double kMargin_n = 40;                                // over what is asked for, before it is a collision
constexpr double kForceMax_n = 120;
constexpr double kTolerance_n = 1.0, kTolerance = 0.05;              // of the force, whichever is more
constexpr Duration kRested = std::chrono::milliseconds(50);          // after the motion, before the law changes
constexpr Duration kTouchWithin = std::chrono::seconds(4);           // then there is nothing to press on,
constexpr Duration kSettleWithin = std::chrono::milliseconds(1500);  // and from the touch until the force is held
constexpr Duration kSteady = std::chrono::milliseconds(300);         // within the tolerance, before it counts
constexpr double kRise_m = 0.08;

// Over a region's middle, from where the arm feels its way down.
double height_over(const world::Place& region) { return 0.5 * region.size_m.z() + kOver_m; }

Expected<Vector3> over_region(const world::World& world, const std::string& name) {
  const world::Place* const place = world.place(name);
  if (place == nullptr || place->kind != world::PlaceKind::kRegion) {
    const bool any = std::ranges::count(world.places, world::PlaceKind::kRegion, &world::Place::kind) > 0;
    return fail("'" + name + "' is no region", {},
                any ? "name a place of kind region" : "this world has no place of kind region; draw one in world.yaml");
  }
  return Vector3(place->center_m + Vector3(0, 0, height_over(*place)));
}

class Press final : public ArmSkill {
 public:
  Press(Cell& cell, std::string place, double force_n, Duration hold)
      : cell_(cell), place_(std::move(place)), force_n_(force_n), hold_(hold) {}

  Progress tick(Time now) override {
    if (!cell_.arm.operational()) {
      stopped_ = true;
      return cancelled_ ? Progress{Status::kFailed, "cancelled while the arm was stopped", {}} : Progress{};
    }
    if (stopped_ && phase_ != Phase::kRise) begin_rise({Status::kRetry, "the arm was stopped", {}});
    switch (phase_) {
      case Phase::kStart:
        return start(now);
      case Phase::kGo:
        return go(now);
      case Phase::kFeel:
        return feel(now);
      case Phase::kHold:
        return hold(now);
      case Phase::kRise:
        return rise(now);
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time now) override {
    cancelled_ = true;
    if (!cell_.arm.operational()) return;
    if (phase_ == Phase::kGo && cell_.arm.stop(now)) arrives_ = cell_.arm.motion_end();
    if (phase_ != Phase::kRise) begin_rise({Status::kFailed, "cancelled", {}});
  }

  // Not in the middle of pressing.
  bool may_rest(Time, task::Pause) override {
    if (phase_ != Phase::kStart && phase_ != Phase::kGo) return false;
    if (cell_.arm.state().controller != link::Controller::kTracking || asked_) return false;
    phase_ = Phase::kStart;
    known_.reset();
    return true;
  }
  void go_on(Time, Duration) override {}

 private:
  enum class Phase : std::uint8_t { kStart, kGo, kFeel, kHold, kRise };

  // What the wrist feels against the tool's axis.
  [[nodiscard]] double felt_n() const { return -cell_.arm.state().wrist_wrench[2]; }
  [[nodiscard]] double tolerance_n() const { return std::max(kTolerance_n, kTolerance * force_n_); }
  [[nodiscard]] bool is_held() const { return std::abs(felt_n() - force_n_) <= tolerance_n(); }

  Progress start(Time now) {
    if (cell_.held) return {Status::kFailed, "the cups hold " + cell_.held->code, {}};
    const auto over = over_region(cell_.world, place_);
    if (!over) return {Status::kFailed, over.error().line(), {}};
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const double yaw = yaw_of(cell_.model.world_from_tip(state.position).linear());
    const auto q = cell_.model.inverse(Cell::tip_down(*over, yaw), state.position);
    if (!q) return {Status::kFailed, q.error().line(), {}};
    const auto way = cell_.router.route(state, from, {*q, AxisVector::Zero(q->size())}, nullptr, cell_.objects(),
                                        cell_.limits_empty(), &known_);
    if (!way && cell_.router.spent()) return {};
    known_.reset();
    if (!way) return {Status::kRetry, way.error().line(), {}};
    if (auto sent = cell_.arm.stream(*way); !sent) return {Status::kRetry, sent.error().line(), {}};
    arrives_ = way->back().end();
    phase_ = Phase::kGo;
    return {};
  }

  Progress go(Time now) {
    if (now < arrives_ + kRested) return {};
    if (cell_.arm.state().controller == link::Controller::kAdmittance) {
      phase_ = Phase::kFeel;
      began_ = now;
      return {};
    }
    link::Compliance compliance;
    compliance.stiffness = {kAcross_n_m, kAcross_n_m, 0, kUpright_nm_rad, kUpright_nm_rad, kUpright_nm_rad};
    compliance.damping = {kAcross_ns_m,     kAcross_ns_m,     std::max(kLeastDamping_ns_m, force_n_ / kComeDown_m_s),
                          kUpright_nms_rad, kUpright_nms_rad, kUpright_nms_rad};
    compliance.wrench[2] = force_n_;
    compliance.force_max_n = kForceMax_n;
    cell_.arm.expect_contact(force_n_ + kMargin_n);
    cell_.arm.control(link::Controller::kAdmittance, compliance);
    asked_ = true;
    return {};
  }

  Progress feel(Time now) {
    if (felt_n() < 0.5 * force_n_) {
      touched_.reset();
      if (now < began_ + kTouchWithin) return {};
      begin_rise({Status::kFailed, "there is nothing to press on", {}});
      return {};
    }
    if (!touched_) touched_ = now;
    steady_since_ = is_held() ? steady_since_.value_or(now) : std::optional<Time>();
    if (steady_since_ && now >= *steady_since_ + kSteady) {
      began_ = now;
      least_n_ = most_n_ = felt_n();
      phase_ = Phase::kHold;
    } else if (now >= *touched_ + kSettleWithin) {
      begin_rise({Status::kFailed, fmt::format("the force does not settle: {:.1f} N", felt_n()), {}});
    }
    return {};
  }

  Progress hold(Time now) {
    least_n_ = std::min(least_n_, felt_n());
    most_n_ = std::max(most_n_, felt_n());
    if (!is_held()) {
      begin_rise({Status::kFailed, fmt::format("felt {:.1f} N instead of {:.1f} N", felt_n(), force_n_), {}});
    } else if (now >= began_ + hold_) {
      begin_rise({Status::kSucceeded, {}, {{"place", place_}, {"least_n", least_n_}, {"most_n", most_n_}}});
    }
    return {};
  }

  void begin_rise(Progress verdict) {
    verdict_ = std::move(verdict);
    phase_ = Phase::kRise;
    rising_ = false;
  }

  // The arm follows its motion again, from where it is held; then straight up.
  Progress rise(Time now) {
    if (rising_ || now < arrives_ + kRested) return finish(now);
    if (cell_.arm.state().controller != link::Controller::kTracking) {
      cell_.arm.control(link::Controller::kTracking);
      return {};
    }
    const Time from = cell_.arm.splice_time(now);
    const AxisState state = cell_.arm.planned(from);
    const auto up = nudge(cell_, state, from, cell_.model.world_from_tip(state.position).linear(), {0, 0, kRise_m},
                          Vector3::Zero(), cell_.limits_empty());
    if (up && cell_.arm.stream(*up)) arrives_ = up->back().end();
    rising_ = true;
    return {};
  }

  Progress finish(Time now) {
    if (!rising_ || now < arrives_) return {};
    cell_.arm.expect_contact(0);
    return verdict_;
  }

  Cell& cell_;
  std::string place_;
  double force_n_;
  Duration hold_;
  std::optional<Passage> known_;
  Phase phase_ = Phase::kStart;
  Time arrives_, began_;
  std::optional<Time> touched_, steady_since_;
  double least_n_ = 0, most_n_ = 0;
  Progress verdict_;
  bool asked_ = false;  // for the law to press by
  bool rising_ = false, stopped_ = false, cancelled_ = false;
};

Expected<void> feasible(Cell& cell, const std::string& place, double force_n) {
  const auto over = over_region(cell.world, place);
  if (!over) return std::unexpected(over.error());
  const std::array heights_m{height_over(*cell.world.place(place))};
  if (auto led = cell.reach.over(place, heights_m); !led) return led;
  const auto posture = cell.reach.posture(*over, place);
  if (!posture) return std::unexpected(posture.error());
  return cell.reach.can_press(*posture, force_n);
}

}  // namespace

task::SkillType press(Cell& cell) {
  std::vector<std::string> regions;
  for (const world::Place& place : cell.world.places) {
    if (place.kind != world::PlaceKind::kRegion) continue;
    cell.reach.foresee(place.name, std::array{height_over(place)});
    regions.push_back(place.name);
  }
  if (regions.empty()) regions = cell.world.place_names();  // of which none will do; feasible() says what would
  return {.name = "press",
          .summary = "Press the tool down on a region with a force, hold it, and rise",
          .schema = {{"type", "object"},
                     {"properties",
                      {{"place", {{"enum", std::move(regions)}}},
                       {"force_n", {{"type", "number"}, {"minimum", 5}, {"maximum", 60}}},
                       {"seconds", {{"type", "number"}, {"minimum", 0.1}, {"maximum", 10}}}}},
                     {"required", {"place", "force_n", "seconds"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = std::chrono::seconds(30),
          .attempts = 2,
          .outputs = {"least_n", "most_n"},
          .safe_points = {"on the way there", "risen again"},
          .feasible =
              [&cell](const task::Json& arguments, task::Moment) {
                return feasible(cell, arguments.at("place").get<std::string>(), arguments.at("force_n").get<double>());
              },
          .start =
              [&cell](const task::Json& arguments, Time) {
                return conduct(cell, std::make_unique<Press>(cell, arguments.at("place").get<std::string>(),
                                                             arguments.at("force_n").get<double>(),
                                                             from_s(arguments.at("seconds").get<double>())));
              }};
}

}  // namespace pons::skills
