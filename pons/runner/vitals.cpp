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
constexpr Duration kBeltSlowFor = std::chrono::seconds(1);
constexpr double kStands_m_s = 0.002, kSlowShare = 0.5;  // of the slowest that it runs nominally
constexpr double kNearlyFull = 0.8;                      // of the tasks that may be open
constexpr std::uint64_t kPlenty = 4;                     // times what is kept free
constexpr Duration kSlowDisk =
    std::chrono::milliseconds(100);  // for a commit: the loop hears nothing meanwhile, and stops
constexpr Duration kStuckDisk = std::chrono::seconds(1);
constexpr Duration kDiskLookedAt = std::chrono::seconds(1);  // so often
constexpr double kMiB = 1 << 20;
constexpr Duration kLate = std::chrono::milliseconds(50);      // between two periods of the bridge,
constexpr Duration kTooLate = std::chrono::milliseconds(100);  // which the loop takes for its death

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
