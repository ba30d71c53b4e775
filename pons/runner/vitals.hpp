// What is measured of each part that all robots share, once a bridge period, and how it fares by that.
// docs/degradation.md has the table of what each condition means and what the robots do then.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/health.hpp"
#include "pons/runner/observer.hpp"
#include "pons/runner/skill_port.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// So long the brain may say nothing before the belt waits for it.
inline constexpr Duration kBrainSilent = std::chrono::milliseconds(300);
// So long no picture may have shown all of the belt before it waits. Frames come four times a second, and later by what
// it takes to see what they show.
inline constexpr Duration kBlind = std::chrono::milliseconds(800);

inline constexpr std::uint64_t kKeptFree = 64ULL << 20;  // bytes on the journal's disk

// Each is told of once a period, in any order.
class Vitals {
 public:
  // Both must outlive it.
  Vitals(const world::World& world, Health& health);

  void brain(Time heard, Time now);
  // What the cameras show, by the newest snapshot, which came so much later than it was due.
  void eyes(const Snapshot& seen, Duration behind, Time now);
  void belt(const link::State& state, Time now);
  // How many tasks have no outcome yet; a period that comes late is measured here, too.
  void bridge(std::size_t open, Time now);
  // How much room it has, and how long it waits for the disk.
  void journal(const bridge::Journal& journal, Time now);

  // So much room on its disk is kept for what is open already: with less, no new task is taken. 0: as if there were
  // room always.
  void keep_free(std::uint64_t bytes) { keep_free_ = bytes; }

  // Why no new task is to be taken; empty: there is room for them.
  [[nodiscard]] const std::string& lacks_room() const { return lacks_room_; }
  // Whether a camera that watches the belt is lost: nobody knows what lies there.
  [[nodiscard]] bool belt_unseen() const { return belt_unseen_; }

 private:
  void camera(std::size_t i, const Snapshot& seen, Time now);
  [[nodiscard]] bool is_triggered(const world::CameraSpec& camera) const;

  const world::World& world_;
  Health& health_;
  std::optional<Time> begun_;        // the first look at the cameras
  std::vector<Time> awaited_since_;  // a camera that was not asked for pictures before
  bool belt_unseen_ = false;
  std::uint64_t keep_free_ = kKeptFree;
  std::string lacks_room_;
  std::optional<Time> belt_slow_since_;
  Time last_period_;
  Time journal_looked_at_;
};

}  // namespace pons::runner
