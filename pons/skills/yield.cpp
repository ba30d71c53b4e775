#include "pons/skills/yield.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pons/skills/conduct.hpp"

namespace pons::skills {
namespace {

using task::Progress;
using task::Status;

constexpr double kStiffness_n_m = 300, kSoftest_n_m = 100, kStiffest_n_m = 2000;
constexpr double kTurning_nm_rad = 60, kTurning_nms_rad = 8;
constexpr double kTipMass_kg = 5;  // about what an arm of this size has there, for the damping
constexpr double kPush_n = 100;    // harder is a collision
constexpr double kForceMax_n = 150;
constexpr double kLatestDrives_s = 0.005;                    // the cerebellum is no spring with drives that act later
constexpr Duration kRested = std::chrono::milliseconds(50);  // after the motion, before the law changes

// The damping is critical for kTipMass_kg.
link::Compliance springs(double stiffness_n_m) {
  const double damping_ns_m = 2 * std::sqrt(kTipMass_kg * stiffness_n_m);
  link::Compliance compliance;
  compliance.stiffness = {stiffness_n_m,   stiffness_n_m,   stiffness_n_m,
                          kTurning_nm_rad, kTurning_nm_rad, kTurning_nm_rad};
  compliance.damping = {damping_ns_m, damping_ns_m, damping_ns_m, kTurning_nms_rad, kTurning_nms_rad, kTurning_nms_rad};
  compliance.force_max_n = kForceMax_n;
  return compliance;
}

class Yield final : public ArmSkill {
 public:
  Yield(Cell& cell, Duration hold, double stiffness_n_m) : cell_(cell), hold_(hold), stiffness_n_m_(stiffness_n_m) {}

  Progress tick(Time now) override {
    if (!cell_.arm.operational()) {
      stopped_ = true;
      return cancelled_ ? end({Status::kFailed, "cancelled while the arm was stopped", {}}) : Progress{};
    }
    if (stopped_) return end({Status::kRetry, "the arm was stopped", {}});
    switch (phase_) {
      case Phase::kRest:
        return rest(now);
      case Phase::kYield:
        return yield(now);
      case Phase::kHold:
        return hold();
    }
    return {Status::kFailed, "unreachable", {}};
  }

  void cancel(Time) override {
    cancelled_ = true;
    cell_.arm.control(link::Controller::kTracking);  // also when the change to springs is still on its way
    phase_ = Phase::kHold;
  }

  // Stiff again; what is left of the time comes later.
  bool may_rest(Time now, task::Pause) override {
    if (phase_ == Phase::kHold && !stiff_from_) return false;  // it ends
    if (!stiff_from_) {
      if (phase_ == Phase::kYield) hold_ = std::max(Duration{0}, hold_ - (now - began_));
      cell_.arm.control(link::Controller::kTracking);  // also when the change to springs is still on its way
      phase_ = Phase::kHold;
      stiff_from_ = now + kRested;
    }
    return now >= *stiff_from_ && cell_.arm.state().controller == link::Controller::kTracking;
  }
  void go_on(Time, Duration) override { phase_ = Phase::kRest; }

 private:
  enum class Phase : std::uint8_t { kRest, kYield, kHold };

  [[nodiscard]] Vector3 tip() { return cell_.model.world_from_tip(cell_.arm.state().position).translation(); }

  Progress rest(Time now) {
    if (cell_.held) return {Status::kFailed, "the cups hold " + cell_.held->code, {}};
    if (cell_.world.robot.drive_delay_s > kLatestDrives_s)
      return {Status::kFailed, "the drives act too late to be a spring: see robot.drive_delay_s", {}};
    if (now < cell_.arm.motion_end() + kRested || now < stiff_from_.value_or(now)) return {};
    stiff_from_.reset();
    if (cell_.arm.state().controller != link::Controller::kImpedance) {
      held_at_ = tip();
      cell_.arm.expect_contact(kPush_n);
      cell_.arm.control(link::Controller::kImpedance, springs(stiffness_n_m_));
      return {};
    }
    began_ = now;
    phase_ = Phase::kYield;
    return {};
  }

  Progress yield(Time now) {
    most_m_ = std::max(most_m_, (tip() - held_at_).norm());
    if (now >= began_ + hold_) phase_ = Phase::kHold;
    return {};
  }

  // The arm follows its motion again, from where it is held.
  Progress hold() {
    if (cell_.arm.state().controller != link::Controller::kTracking) {
      cell_.arm.control(link::Controller::kTracking);
      return {};
    }
    if (cancelled_) return end({Status::kFailed, "cancelled", {}});
    if (stiff_from_) return {};
    const double moved_m = (tip() - held_at_).norm();
    return end({Status::kSucceeded, {}, {{"most_m", most_m_}, {"moved_m", moved_m}}});
  }

  Progress end(Progress verdict) {
    cell_.arm.expect_contact(0);
    return verdict;
  }

  Cell& cell_;
  Duration hold_;
  double stiffness_n_m_;
  Phase phase_ = Phase::kRest;
  Time began_;
  Vector3 held_at_ = Vector3::Zero();
  double most_m_ = 0;
  std::optional<Time> stiff_from_;  // a pause was asked for: by then the arm has left its springs
  bool stopped_ = false, cancelled_ = false;
};

}  // namespace

task::SkillType yield(Cell& cell) {
  return {.name = "yield",
          .summary = "Hold the tool like a spring for a while, so that a person may push the arm aside",
          .schema = {{"type", "object"},
                     {"properties",
                      {{"seconds", {{"type", "number"}, {"minimum", 0.1}, {"maximum", 60}}},
                       {"stiffness_n_m", {{"type", "number"}, {"minimum", kSoftest_n_m}, {"maximum", kStiffest_n_m}}}}},
                     {"required", {"seconds"}},
                     {"additionalProperties", false}},
          .resources = {cell.world.arm},
          .timeout = std::chrono::seconds(70),
          .attempts = 2,
          .outputs = {"most_m", "moved_m"},
          .safe_points = {"anywhere, stiff"},
          .start = [&cell](const task::Json& arguments, Time) {
            return conduct(cell, std::make_unique<Yield>(cell, from_s(arguments.at("seconds").get<double>()),
                                                         arguments.value("stiffness_n_m", kStiffness_n_m)));
          }};
}

}  // namespace pons::skills
