#include "pons/runner/vitals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/runner/run.hpp"

namespace pons::runner {
namespace {

using link::SafetyState;

constexpr Duration kBrainGone = std::chrono::seconds(2);
constexpr Duration kBehind = std::chrono::milliseconds(500);
constexpr int kPicturesMissed = 3, kPicturesLost = 6;  // in a row
// Half and more of what stops the arm (cerebellum's limit is 0.05 rad).
constexpr double kFollowing_rad = 0.03;
constexpr Duration kEvacuated = std::chrono::milliseconds(100);  // after it has sealed a cup has all its vacuum
constexpr double kFullShare = 0.85;                              // of the best: seals differ by so much
constexpr double kLeastShare = 0.1;                              // what sealed holds something
constexpr double kDrawsShare = 0.45;   // of what counts as sealed: a cup that lies on something draws more
constexpr double kNothingShare = 0.1;  // likewise: a pump that runs draws more, whatever the cups touch
constexpr int kTooWeak = 4;            // attempts: single ones leak
constexpr Duration kTriedAgainAfter = std::chrono::seconds(10);
constexpr Duration kBeltSlowFor = std::chrono::seconds(1);
constexpr double kStands_m_s = 0.002, kSlowShare = 0.5;  // of the slowest that it runs nominally
constexpr Duration kCountedOver = std::chrono::seconds(1);
constexpr double kMissedSome = 0.01, kMissedMany = 0.10;  // of the loop's ticks
constexpr double kNearlyFull = 0.8;                       // of the tasks that may be open
constexpr std::uint64_t kPlenty = 4;                      // times what is kept free
constexpr Duration kSlowDisk =
    std::chrono::milliseconds(100);  // for a commit: the loop hears nothing meanwhile, and stops
constexpr Duration kStuckDisk = std::chrono::seconds(1);
constexpr Duration kDiskLookedAt = std::chrono::seconds(1);  // so often
constexpr double kMiB = 1 << 20;
constexpr Duration kLate = std::chrono::milliseconds(50);      // between two periods of the bridge,
constexpr Duration kTooLate = std::chrono::milliseconds(100);  // which the loop takes for its death

std::string stopped(const link::State& state) {
  if (state.cause == link::StopCause::kNone) return std::string(link::name(state.safety));
  return fmt::format("{}: {}", link::name(state.safety), link::name(state.cause));
}

std::string_view robot_part(const world::World& world) { return world.base ? "base" : "arm"; }

}  // namespace

Vitals::Vitals(const world::World& world, Health& health)
    : world_(world), health_(health), awaited_since_(world.cameras.size()) {}

void Vitals::brain(Time heard, Time now) {
  const Duration silent = now - heard;
  const Condition condition = silent > kBrainGone     ? Condition::kBad
                              : silent > kBrainSilent ? Condition::kPoor
                                                      : Condition::kGood;
  const std::string why = condition == Condition::kGood ? "" : fmt::format("silent for {:.1f} s", to_s(silent));
  health_.tell("brain", condition, why, now);
}

// It skips its turn while there is nothing to read, where another one finds what lies on the belt.
bool Vitals::is_triggered(const world::CameraSpec& camera) const {
  const auto finds = [](const world::CameraSpec& c) { return c.watches == "belt" && !c.reads_labels; };
  return camera.reads_labels && std::ranges::any_of(world_.cameras, finds);
}

void Vitals::camera(std::size_t i, const Snapshot& seen, Time now) {
  const world::CameraSpec& spec = world_.cameras[i];
  if (is_triggered(spec) && !seen.wants_labels) awaited_since_[i] = now;
  const Time shown = i < seen.shown.size() ? seen.shown[i] : Time{};
  const Duration without = now - from_s(spec.latency_s) - std::max({shown, awaited_since_[i], *begun_});
  const Duration period = from_s(spec.period_s);
  const Condition condition = without > kPicturesLost * period     ? Condition::kBad
                              : without > kPicturesMissed * period ? Condition::kPoor
                                                                   : Condition::kGood;
  const std::string why =
      condition == Condition::kGood ? "" : fmt::format("no picture that shows anything for {:.1f} s", to_s(without));
  const std::string part = "camera " + spec.name;
  health_.tell(part, condition, why, now);
  belt_unseen_ = belt_unseen_ || (spec.watches == "belt" && health_.is_bad(part));
}

void Vitals::eyes(const Snapshot& seen, Duration behind, Time now) {
  if (!begun_) begun_ = now;
  belt_unseen_ = false;
  bool shows_belt = false;
  for (std::size_t i = 0; i < world_.cameras.size(); ++i) {
    camera(i, seen, now);
    const bool of_belt = world_.cameras[i].watches == "belt" && i < seen.shown.size();
    shows_belt = shows_belt || (of_belt && now - seen.shown[i] <= kBlind);
  }
  if (world_.cameras.empty()) return;
  if (behind > kBehind) {
    return health_.tell("perception", Condition::kBad,
                        fmt::format("what pictures show is known {:.1f} s late", to_s(behind)), now);
  }
  const bool hidden = shows_belt && now - seen.belt_clear > kBlind;
  health_.tell("perception", hidden ? Condition::kPoor : Condition::kGood,
               hidden ? "something hides a part of the belt" : "", now);
}

void Vitals::arm(const link::State& state, Resumes resumes, Time now) {
  const auto tell = [&](Condition condition, const std::string& why) {
    health_.tell(robot_part(world_), condition, why, now);
  };
  if (resumes == Resumes::kByPerson) return tell(Condition::kBad, stopped(state) + "; a person resets and arms it");
  if (state.safety == SafetyState::kDisarmed) return tell(Condition::kGood, "");  // about to be armed
  if (state.safety != SafetyState::kOperational) return tell(Condition::kPoor, stopped(state));
  // Where the drives act later, it is told so much sooner where to be.
  const AxisVector told = state.commanded.position - world_.robot.drive_delay_s * state.commanded.speed;
  const double off_rad = state.controller == link::Controller::kTracking && state.position.size() == told.size()
                             ? (told - state.position).lpNorm<Eigen::Infinity>()
                             : 0.0;
  if (off_rad > kFollowing_rad)
    return tell(Condition::kPoor, fmt::format("{:.3f} rad from where it was told to be", off_rad));
  tell(Condition::kGood, "");
}

void Vitals::measure_attempt(const link::State& state, Time now) {
  const double kpa = *std::ranges::max_element(state.cup_vacuum_kpa);
  if (!attempt_) attempt_ = Attempt{.began = now};
  attempt_->most_kpa = std::max(attempt_->most_kpa, kpa);
  if (state.vacuum.phase != link::VacuumPhase::kSealed) {
    attempt_->sealed_since.reset();
    return;
  }
  if (!attempt_->sealed_since) attempt_->sealed_since = now;
  attempt_->sealed = true;
  too_weak_ = 0;
  if (now - *attempt_->sealed_since < kEvacuated) return;
  best_kpa_ = std::max(best_kpa_, kpa);
  grip_share_ = kpa >= kFullShare * best_kpa_ ? 1 : std::max(kpa / best_kpa_, kLeastShare);
}

Grip Vitals::vacuum(const link::State& state, Time now) {
  if (state.vacuum_on != 0) {
    measure_attempt(state, now);
  } else if (attempt_) {
    // Cups that touch nothing draw a little, and tell nothing of the pump.
    const double of_sealed = attempt_->most_kpa / world_.robot.tool.sealed_kpa;
    const bool weak = !attempt_->sealed && now - attempt_->began > kEvacuated &&
                      (of_sealed > kDrawsShare || of_sealed < kNothingShare);
    too_weak_ += weak ? 1 : 0;
    if (weak) too_weak_at_ = now;
    attempt_.reset();
  }
  if (too_weak_ >= kTooWeak && now - too_weak_at_ < kTriedAgainAfter) {
    health_.tell("vacuum", Condition::kBad, fmt::format("too weak to seal, {} times in a row", too_weak_), now);
  } else if (too_weak_ >= kTooWeak) {
    health_.tell("vacuum", Condition::kPoor, "it is tried again", now);
  } else if (grip_share_ < 1) {
    health_.tell("vacuum", Condition::kPoor, fmt::format("{:.0f} % of the best so far", 100 * grip_share_), now);
  } else {
    health_.tell("vacuum", Condition::kGood, "", now);
  }
  return {.share = grip_share_, .lifts = !health_.is_bad("vacuum")};
}

void Vitals::belt(const link::State& state, Time now) {
  if (world_.base) return;
  const world::Belt& belt = world_.belt;
  const double slow_m_s = kSlowShare * belt.speed_m_s * (1 - belt.speed_variation);
  const bool runs = state.belt == link::Belt::kRuns && state.safety == SafetyState::kOperational;
  if (!runs || state.belt_speed_m_s >= slow_m_s) belt_slow_since_.reset();
  if (runs && state.belt_speed_m_s < slow_m_s && !belt_slow_since_) belt_slow_since_ = now;
  if (!belt_slow_since_ || now - *belt_slow_since_ < kBeltSlowFor)
    return health_.tell("belt", Condition::kGood, "", now);
  const bool stands = std::abs(state.belt_speed_m_s) < kStands_m_s;
  health_.tell("belt", stands ? Condition::kBad : Condition::kPoor,
               stands ? std::string("stands although it is told to run")
                      : fmt::format("runs at {:.2f} m/s only", state.belt_speed_m_s),
               now);
}

// By the count of its ticks: what it does in time crosses the link.
void Vitals::loop(const link::State& state, Time now) {
  if (!ticks_) {
    ticks_ = Ticks{now, state.tick};
    return health_.tell("loop", Condition::kGood, "", now);
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
  health_.tell("loop", condition, why, now);
}

void Vitals::bridge(std::size_t open, Time now) {
  const Duration since = last_period_ > Time{} ? now - last_period_ : Duration{0};
  last_period_ = now;
  const auto tell = [&](Condition condition, const std::string& why) { health_.tell("bridge", condition, why, now); };
  if (open >= bridge::kMaxOpen) return tell(Condition::kBad, fmt::format("{} tasks are open: no more are taken", open));
  if (since > kTooLate) return tell(Condition::kBad, fmt::format("a period came after {:.0f} ms", 1e3 * to_s(since)));
  if (since > kLate) return tell(Condition::kPoor, fmt::format("a period came after {:.0f} ms", 1e3 * to_s(since)));
  if (static_cast<double>(open) > kNearlyFull * static_cast<double>(bridge::kMaxOpen))
    return tell(Condition::kPoor, fmt::format("{} of {} tasks that may be open are", open, bridge::kMaxOpen));
  tell(Condition::kGood, "");
}

void Vitals::journal(const bridge::Journal& journal, Time now) {
  if (journal_looked_at_ > Time{} && now - journal_looked_at_ < kDiskLookedAt) return;
  journal_looked_at_ = now;
  const auto tell = [&](Condition condition, const std::string& why) { health_.tell("journal", condition, why, now); };
  const Duration waited = journal.take_longest_commit();
  const std::optional<std::uint64_t> room = journal.room();
  const std::string left = fmt::format("{:.0f} MiB left on its disk", static_cast<double>(room.value_or(0)) / kMiB);
  if (room && *room < keep_free_) {
    lacks_room_ = left;
    return tell(Condition::kBad, left);
  }
  if (waited > kStuckDisk) {
    tell(Condition::kBad, fmt::format("a commit took {:.1f} s", to_s(waited)));
  } else if (room && *room / kPlenty < keep_free_) {
    tell(Condition::kPoor, left);
  } else if (waited > kSlowDisk) {
    tell(Condition::kPoor, fmt::format("a commit took {:.0f} ms", 1e3 * to_s(waited)));
  } else {
    tell(Condition::kGood, "");
  }
  if (!health_.is_bad("journal")) lacks_room_.clear();
}

}  // namespace pons::runner
