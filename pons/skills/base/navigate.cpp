// To a pose on the map: plans a way, drives it with a new look ahead every tenth of a second from where the base then
// is, and at rest looks whether it is there.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "pons/skills/base/base_skills.hpp"
#include "pons/skills/base/driven.hpp"

namespace pons::skills {
namespace {

using task::Pause;
using task::Progress;
using task::Status;

// By belief; what is promised is 0.05 m and 0.05 rad in truth.
constexpr double kThere_m = 0.025, kThere_rad = 0.02;
constexpr int kCellsATick = 6000;  // of the search for a way: about a millisecond
constexpr Duration kRenewed = std::chrono::milliseconds(100);
constexpr Duration kSettled = std::chrono::milliseconds(500);  // the filter has seen it stand in a few scans
constexpr Duration kWaitsForRoom = std::chrono::seconds(25);   // who stands in the way may go on
constexpr Duration kWaitsForSight = std::chrono::seconds(10);
constexpr int kLooksInVain = 200;  // looks ahead, 20 s of driving, after which it has not moved by so much
constexpr double kMoved_m = 0.05, kMoved_rad = 0.1;
// What it runs into may be gone round once it is known where it stands, which takes a touch or two.
constexpr int kMostCollisions = 3;
constexpr double kBacksOff_m_s = 0.1, kBackedOff_m = 0.12;
constexpr double kFront_rad = 1.0;  // of its circle, to either side of where it drives
constexpr int kFrontPoints = 9;     // on each side: closer to each other than cells are
constexpr int kCorrections = 8;

task::Json json_of(const Pose2& pose) { return {{"x", pose.x}, {"y", pose.y}, {"yaw", wrapped(pose.yaw)}}; }

class Navigate final : public Driven {
 public:
  Navigate(Chassis& chassis, const Pose2& goal)
      : Driven(chassis), goal_(goal), steer_(chassis.floor, *chassis.world.base, chassis.world.robot.limits) {}

  ~Navigate() override { chassis_.head_for(std::nullopt); }

  Progress tick(Time now) override {
    Progress progress = Driven::tick(now);
    const Vector2 here = chassis_.map_from_base().position();
    const bool on_way = !steer_.way().empty() && (phase_ == Phase::kDrives || phase_ == Phase::kSettles);
    chassis_.head_for({{goal_, on_way ? left_along(steer_.way(), here) : (goal_.position() - here).norm(), detours_}});
    progress.notes = std::exchange(notes_, {});
    return progress;
  }

 private:
  enum class Phase : std::uint8_t { kPlans, kDrives, kSettles };

  void begin_anew() override {
    drives_ = false;
    plan_anew();
  }
  void plan_anew() {
    phase_ = Phase::kPlans;
    search_.reset();
    refused_.reset();
  }

  Progress go(Time now) override {
    if (!chassis_.wheels.operational()) return is_stopped();
    if (struck_) return remember_what_it_struck(now);
    if (!chassis_.sure()) return look_for_itself(now);
    unsure_since_.reset();
    drives_ = true;
    if (backs_off_from_) return back_off(now);
    switch (phase_) {
      case Phase::kPlans:
        return plan(now);
      case Phase::kDrives:
        return drive(now);
      case Phase::kSettles:
        return settle(now);
    }
    return {Status::kFailed, "unreachable"};
  }

  // By the loop. A stop on a collision ends by itself.
  Progress is_stopped() {
    const Pose2& here = chassis_.map_from_base();
    if (std::exchange(drives_, false)) {
      plan_anew();
      if (chassis_.wheels.has_struck())
        struck_ = Struck{here, chassis_.drive.twist(chassis_.wheels.state().commanded.speed).ahead < 0};
    }
    // What it ran into may have given way while it braked.
    if (struck_ && struck_->is_ahead(here.position())) struck_->from = here;
    return {};
  }

  // It may drive again. What the lidar does not show it would run into again and again.
  Progress remember_what_it_struck(Time now) {
    const Vector2 at = feel_front(now);
    notes_.push_back({"collision", {{"at", {at.x(), at.y()}}}});
    backs_off_from_ = std::exchange(struck_, std::nullopt);
    renewed_at_.reset();
    if (++collisions_ < kMostCollisions) return {};
    return {Status::kFailed,
            fmt::format("ran into something at ({:.2f}, {:.2f}) m that its lidar does not see, after {} collisions",
                        at.x(), at.y(), collisions_),
            detail()};
  }

  // Whatever stopped it stands somewhere along the side on which it drove. Where the middle of that is, map frame.
  Vector2 feel_front(Time now) {
    const Pose2 front = struck_->front();
    const auto towards = [&](double aside_rad) {
      return front * Vector2(chassis_.world.base->radius_m * Vector2(std::cos(aside_rad), std::sin(aside_rad)));
    };
    std::vector<Vector2> points;
    for (int i = -kFrontPoints; i <= kFrontPoints; ++i) points.push_back(towards(kFront_rad * i / kFrontPoints));
    chassis_.floor.feel(points, now);
    return towards(0);
  }

  // The way it came, out of touch with what it ran into: turning there it would rub along it.
  Progress back_off(Time now) {
    if (renewed_at_ && now < *renewed_at_ + kRenewed) return {};
    renewed_at_ = now;
    const Time from = chassis_.wheels.splice_time(now);
    const Rolling start = chassis_.expected(from);
    if ((start.map_from_base.position() - backs_off_from_->from.position()).norm() >= kBackedOff_m) {
      backs_off_from_.reset();
      return {};
    }
    const model::Twist2 back{backs_off_from_->backwards ? kBacksOff_m_s : -kBacksOff_m_s, 0};
    if (const auto held = steer_.hold(start, from, back, Room::kKnown)) {
      if (auto sent = chassis_.wheels.stream(*held); !sent) return {Status::kRetry, sent.error().line(), detail()};
    }
    return no_headway(now);
  }

  Progress look_for_itself(Time now) {
    if (!unsure_since_) {
      brake(now);
      plan_anew();
      unsure_since_ = now;
    }
    if (now < *unsure_since_ + kWaitsForSight) return {};
    return {Status::kFailed, chassis_.sees()
                                 ? "the base does not know where it is: too little of what its lidar sees is on the map"
                                 : "the base sees nothing: its lidar has shown nothing for a while"};
  }

  Progress plan(Time now) {
    if (refused_ && version_ == chassis_.floor.version()) return wait_for_room(now);
    if (!search_ || search_->version() != chassis_.floor.version())
      search_.emplace(chassis_.floor, chassis_.expected(chassis_.wheels.splice_time(now)).map_from_base.position(),
                      goal_.position());
    auto found = search_->go_on(kCellsATick);
    if (!found) return {};
    search_.reset();
    version_ = chassis_.floor.version();
    if (!*found) {
      refused_ = found->error();
      return wait_for_room(now);
    }
    refused_.reset();
    blocked_since_.reset();
    double length_m = 0;
    task::Json corners = task::Json::array();
    for (std::size_t i = 0; i < (*found)->size(); ++i) {
      const Vector2& at = (**found)[i];
      corners.push_back({at.x(), at.y()});
      if (i > 0) length_m += (at - (**found)[i - 1]).norm();
    }
    notes_.push_back({"plan", {{"way", std::move(corners)}, {"length_m", length_m}}});
    if (corrections_ == 0) way_m_ = std::max(way_m_, length_m);
    steer_.follow(std::move(**found), goal_.yaw);
    phase_ = Phase::kDrives;
    renewed_at_.reset();
    return drive(now);
  }

  // A search that found no way is made again when something was seen, or is gone.
  Progress wait_for_room(Time now) {
    brake(now);
    if (!blocked_since_) blocked_since_ = now;
    // What only the map shows does not go away.
    if (chassis_.floor.version() > 0 && now < *blocked_since_ + kWaitsForRoom) return {};
    return {Status::kFailed, refused_->line(), detail()};
  }

  [[nodiscard]] bool way_is_blocked() {
    if (version_ == chassis_.floor.version()) return false;
    version_ = chassis_.floor.version();
    const Way& way = steer_.way();
    for (std::size_t i = 0; i + 1 < way.size(); ++i) {
      if (clearance_along(chassis_.floor, way[i], way[i + 1]) < chassis_.floor.needed_m()) return true;
    }
    return false;
  }

  Progress drive(Time now) {
    if (way_is_blocked()) {
      ++detours_;
      plan_anew();
      return plan(now);
    }
    if (renewed_at_) {
      if (now < *renewed_at_ + kRenewed) return {};
      if (arrives_ && now + 2 * kRenewed >= chassis_.wheels.motion_end()) {
        phase_ = Phase::kSettles;
        return {};
      }
    }
    renewed_at_ = now;
    const Time from = chassis_.wheels.splice_time(now);
    auto steered = steer_.look_ahead(chassis_.expected(from), from);
    arrives_ = steered && steered->arrives;
    if (!steered) {
      brake(now);
      return no_headway(now);
    }
    if (auto sent = chassis_.wheels.stream(steered->wheels); !sent)
      return {Status::kRetry, sent.error().line(), detail()};
    return no_headway(now);
  }

  // Whether it moves at all: the way to its goal may lead away from it for a while. While it plans, waits, or is
  // stopped it does not look ahead, and that does not count.
  Progress no_headway(Time now) {
    const Pose2& here = chassis_.map_from_base();
    const bool moved = !headway_from_ || (here.position() - headway_from_->position()).norm() > kMoved_m ||
                       std::abs(wrapped(here.yaw - headway_from_->yaw)) > kMoved_rad;
    if (moved) {
      headway_from_ = here;
      looks_in_vain_ = 0;
    }
    if (++looks_in_vain_ <= kLooksInVain) return {};
    brake(now);
    return {Status::kFailed,
            fmt::format("stuck at ({:.2f}, {:.2f}) m: there is too little room to drive on", here.x, here.y), detail()};
  }

  // It rests, as it was told: is it there?
  Progress settle(Time now) {
    const Time stands_at = chassis_.wheels.motion_end();
    if (now < stands_at + kSettled || chassis_.belief()->stamp < stands_at + kSettled / 2) return {};
    const Pose2& here = chassis_.map_from_base();
    const double off_m = (here.position() - goal_.position()).norm();
    const double off_rad = std::abs(wrapped(here.yaw - goal_.yaw));
    if (off_m <= kThere_m && off_rad <= kThere_rad) return {Status::kSucceeded, {}, detail()};
    if (++corrections_ > kCorrections) {
      return {Status::kFailed, fmt::format("gets no nearer to its goal than {:.3f} m and {:.3f} rad", off_m, off_rad),
              detail()};
    }
    plan_anew();
    return {};
  }

  [[nodiscard]] task::Json detail() const {
    const Eigen::Matrix3d& covariance = chassis_.belief()->covariance;
    return {{"goal", json_of(goal_)},
            {"pose", json_of(chassis_.map_from_base())},
            {"sigma_m", std::sqrt(std::max(covariance(0, 0), covariance(1, 1)))},
            {"way_m", way_m_},
            {"detours", detours_},
            {"collisions", collisions_},
            {"corrections", corrections_}};
  }

  const Pose2 goal_;
  Steer steer_;
  Phase phase_ = Phase::kPlans;
  std::optional<WaySearch> search_;
  std::optional<Error> refused_;    // by the last search
  std::uint64_t version_ = 0;       // of the floor when the way was last looked at
  std::optional<Time> renewed_at_;  // the newest look ahead along this way,
  bool arrives_ = false;            // and whether that ends at the goal
  std::optional<Time> blocked_since_, unsure_since_;
  std::optional<Pose2> headway_from_;
  int looks_in_vain_ = 0;
  // Where it touched what it ran into, and how it drove.
  struct Struck {
    Pose2 from;
    bool backwards = false;
    // It looks where it drove.
    [[nodiscard]] Pose2 front() const { return {from.x, from.y, from.yaw + (backwards ? std::numbers::pi : 0)}; }
    [[nodiscard]] bool is_ahead(const Vector2& at) const { return (at - from.position()).dot(front().ahead()) > 0; }
  };
  std::optional<Struck> struck_;          // since it was stopped so, until it may drive again;
  std::optional<Struck> backs_off_from_;  // from then on, until it is out of touch
  bool drives_ = false;                   // so that a stop is of what it did itself
  int corrections_ = 0, detours_ = 0, collisions_ = 0;
  double way_m_ = 0;
  std::vector<task::Note> notes_;
};

// What a tree's blackboard has brought about: nobody could review it before.
class Refused final : public task::Skill {
 public:
  explicit Refused(const Error& why) : why_(why.line()) {}
  Progress tick(Time) override {
    Progress progress{Status::kFailed, why_};
    progress.stop = task::StopResult::kConfirmed;
    return progress;
  }
  void pause(Time, Pause) override {}
  void resume(Time) override {}
  void cancel(Time) override {}
  void halt(Time) override {}

 private:
  std::string why_;
};

constexpr const char* kDock = "dock";

task::SkillType driving(std::string name, std::string summary) {
  return {.name = std::move(name),
          .summary = std::move(summary),
          .resources = {"base"},
          .timeout = std::chrono::minutes(5),
          .attempts = 2,
          .outputs = {"pose", "way_m", "detours"},
          .safe_points = {"anywhere, at rest"}};
}

}  // namespace

Expected<Pose2> goal_of(const task::Json& arguments, const world::World& world) {
  const bool by_name = arguments.contains("place");
  const bool by_pose = arguments.contains("x") && arguments.contains("y");
  const bool part = arguments.contains("x") || arguments.contains("y") || arguments.contains("yaw");
  if (by_name ? part : !by_pose)
    return fail(by_name ? "has both a place and a pose" : "has neither a place nor a pose", "navigate",
                R"(write {"place":…}, or {"x":…,"y":…,"yaw":…})");
  Pose2 goal;
  if (by_name) {
    const world::Station* station = world.base->station(arguments.at("place").get<std::string>());
    if (station == nullptr) return fail("there is no such place", "navigate", "pons skills navigate lists them");
    return station->map_from_base;
  }
  goal = {arguments.at("x").get<double>(), arguments.at("y").get<double>(), arguments.value("yaw", 0.0)};
  if (world.map->ground(goal.position()) != world::Ground::kFree ||
      world.map->distance_m(goal.position()) < world.base->radius_m) {
    return fail(fmt::format("the map has no room for the base at ({:.2f}, {:.2f}) m", goal.x, goal.y), "navigate",
                "choose a goal in the open");
  }
  return goal;
}

task::SkillType navigate(Chassis& chassis) {
  std::vector<std::string> names;
  for (const world::Station& station : chassis.world.base->stations) names.push_back(station.name);
  const task::Json number{{"type", "number"}, {"minimum", -1e4}, {"maximum", 1e4}};
  task::SkillType type = driving("navigate", "Drive to a pose on the map, or to a station by its name");
  type.schema = {{"type", "object"},
                 {"properties",
                  {{"x", number},
                   {"y", number},
                   {"yaw", {{"type", "number"}, {"minimum", -7}, {"maximum", 7}}},
                   {"frame_id", {{"enum", {"map"}}}},
                   {"place", {{"enum", names}}}}},
                 {"additionalProperties", false}};
  type.feasible = [&chassis](const task::Json& arguments, task::Moment) -> Expected<void> {
    const auto goal = goal_of(arguments, chassis.world);
    if (!goal) return std::unexpected(goal.error());
    return {};
  };
  type.start = [&chassis](const task::Json& arguments, Time) -> std::unique_ptr<task::Skill> {
    const auto goal = goal_of(arguments, chassis.world);
    if (!goal) return std::make_unique<Refused>(goal.error());
    return std::make_unique<Navigate>(chassis, *goal);
  };
  return type;
}

task::SkillType dock(Chassis& chassis) {
  task::SkillType type = driving(kDock, "Drive to the dock and stand there");
  type.resources = {"base", kDock};
  type.schema = {{"type", "object"}, {"properties", task::Json::object()}, {"additionalProperties", false}};
  type.start = [&chassis](const task::Json&, Time) {
    return std::make_unique<Navigate>(chassis, chassis.world.base->station(kDock)->map_from_base);
  };
  return type;
}

}  // namespace pons::skills
