#include "pons/runner/robot_vitals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/runner/run.hpp"

namespace pons::runner {
namespace {

using link::SafetyState;

// Half and more of what stops the arm (cerebellum's limit is 0.05 rad).
constexpr double kFollowing_rad = 0.03;
constexpr Duration kEvacuated = std::chrono::milliseconds(100);  // after it has sealed a cup has all its vacuum
constexpr double kFullShare = 0.85;                              // of the best: seals differ by so much
constexpr double kLeastShare = 0.1;                              // what sealed holds something
constexpr double kDrawsShare = 0.45;   // of what counts as sealed: a cup that lies on something draws more
constexpr double kNothingShare = 0.1;  // likewise: a pump that runs draws more, whatever the cups touch
constexpr int kTooWeak = 4;            // attempts: single ones leak
constexpr Duration kTriedAgainAfter = std::chrono::seconds(10);
constexpr Duration kCountedOver = std::chrono::seconds(1);
constexpr double kMissedSome = 0.01, kMissedMany = 0.10;  // of the loop's ticks

std::string stopped(const link::State& state) {
  if (state.cause == link::StopCause::kNone) return std::string(link::name(state.safety));
  return fmt::format("{}: {}", link::name(state.safety), link::name(state.cause));
}

}  // namespace

RobotVitals::RobotVitals(const world::Robot& robot, std::string name, OneOf one_of, Health& health)
    : robot_(robot),
      name_(std::move(name)),
      vacuum_(one_of == OneOf::kSeveral ? "vacuum " + name_ : "vacuum"),
      loop_(one_of == OneOf::kSeveral ? "loop " + name_ : "loop"),
      health_(health) {}

void RobotVitals::arm(const link::State& state, Resumes resumes, Time now) {
  const auto tell = [&](Condition condition, const std::string& why) { health_.tell(name_, condition, why, now); };
  if (resumes == Resumes::kByPerson) return tell(Condition::kBad, stopped(state) + "; a person resets and arms it");
  if (state.safety == SafetyState::kDisarmed) return tell(Condition::kGood, "");  // about to be armed
  if (state.safety != SafetyState::kOperational) return tell(Condition::kPoor, stopped(state));
  // Where the drives act later, it is told so much sooner where to be.
  const AxisVector told = state.commanded.position - robot_.drive_delay_s * state.commanded.speed;
  const double off_rad = state.controller == link::Controller::kTracking && state.position.size() == told.size()
                             ? (told - state.position).lpNorm<Eigen::Infinity>()
                             : 0.0;
  if (off_rad > kFollowing_rad)
    return tell(Condition::kPoor, fmt::format("{:.3f} rad from where it was told to be", off_rad));
  tell(Condition::kGood, "");
}

void RobotVitals::measure_attempt(const link::State& state, Time now) {
  const double kpa = *std::ranges::max_element(state.cup_vacuum_kpa);
  if (!attempt_) attempt_ = Attempt{.began = now};
  attempt_->most_kpa = std::max(attempt_->most_kpa, kpa);
  // Too few to lift by say something of the parcel; one is enough to show that the pump seals.
  if (state.vacuum.sealed_cups > 0) attempt_->sealed = true, too_weak_ = 0;
  if (state.vacuum.phase != link::VacuumPhase::kSealed) {
    attempt_->sealed_since.reset();
    return;
  }
  if (!attempt_->sealed_since) attempt_->sealed_since = now;
  if (now - *attempt_->sealed_since < kEvacuated) return;
  best_kpa_ = std::max(best_kpa_, kpa);
  grip_share_ = kpa >= kFullShare * best_kpa_ ? 1 : std::max(kpa / best_kpa_, kLeastShare);
}

Grip RobotVitals::vacuum(const link::State& state, Time now) {
  if (state.vacuum_on != 0) {
    measure_attempt(state, now);
  } else if (attempt_) {
    // Cups that touch nothing draw a little, and tell nothing of the pump.
    const double of_sealed = attempt_->most_kpa / robot_.tool.sealed_kpa;
    const bool weak = !attempt_->sealed && now - attempt_->began > kEvacuated &&
                      (of_sealed > kDrawsShare || of_sealed < kNothingShare);
    too_weak_ += weak ? 1 : 0;
    if (weak) too_weak_at_ = now;
    attempt_.reset();
  }
  if (too_weak_ >= kTooWeak && now - too_weak_at_ < kTriedAgainAfter) {
    health_.tell(vacuum_, Condition::kBad, fmt::format("too weak to seal, {} times in a row", too_weak_), now);
  } else if (too_weak_ >= kTooWeak) {
    health_.tell(vacuum_, Condition::kPoor, "it is tried again", now);
  } else if (grip_share_ < 1) {
    health_.tell(vacuum_, Condition::kPoor, fmt::format("{:.0f} % of the best so far", 100 * grip_share_), now);
  } else {
    health_.tell(vacuum_, Condition::kGood, "", now);
  }
  return {.share = grip_share_, .lifts = !health_.is_bad(vacuum_)};
}

// By the count of its ticks: what it does in time crosses the link.
void RobotVitals::loop(const link::State& state, Time now) {
  const bool anew = ticks_ && state.tick < ticks_->count;
  if (!ticks_ || anew) {
    ticks_ = Ticks{now, state.tick};
    return health_.tell(loop_, anew ? Condition::kBad : Condition::kGood, anew ? "it ended, and another began" : "",
                        now);
  }
  const Duration passed = now - ticks_->at;
  if (passed < kCountedOver) return;
  const auto due = static_cast<double>(passed / kControlPeriod);
  const double missed = std::max(0.0, 1 - static_cast<double>(state.tick - ticks_->count) / due);
  ticks_ = Ticks{now, state.tick};
  const Condition condition = missed > kMissedMany   ? Condition::kBad
                              : missed > kMissedSome ? Condition::kPoor
                                                     : Condition::kGood;
  const std::string why =
      condition == Condition::kGood ? "" : fmt::format("{:.1f} % of its ticks missed", 100 * missed);
  health_.tell(loop_, condition, why, now);
}

}  // namespace pons::runner
