// A bridge, or the control loops, killed within a run in lockstep, as `kill -9` kills those in a process of their own,
// and the next that take over: a bridge from its journal, control loops from nothing. Faults
// (docs/decisions/0029-faults-as-data.md); who really has two processes kills one of them.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/observer.hpp"
#include "pons/world/faults.hpp"

namespace pons::runner {

// What of a new bridge the run calls.
struct Above {
  BridgeSide* bridge_side = nullptr;
  Observer* observer = nullptr;
};

// Whether it lives, looked at once in each period or tick.
class Deaths {
 public:
  explicit Deaths(const world::Spells& spells) : spells_(spells) {}

  enum class Now : std::uint8_t {
    kLives,
    kDies,  // in this one
    kDead,
    kFollows,  // in this one the next is to begin
  };
  [[nodiscard]] Now look(Time now) {
    const bool dead = spells_.on(now);
    const bool was = std::exchange(dead_, dead);
    if (dead && !was) ++count_;
    if (dead) return was ? Now::kDead : Now::kDies;
    return was ? Now::kFollows : Now::kLives;
  }
  // Two spells of which nobody saw the end of one are one death.
  [[nodiscard]] std::int64_t count() const { return count_; }

 private:
  world::Spells spells_;
  std::int64_t count_ = 0;
  bool dead_ = false;
};

// All control loops at once, as one process has them. The robots go on as their own watchdogs have it.
struct LoopCrashes {
  Deaths deaths;
  std::function<void(Time)> replace;  // new loops stand on the same links, where the old ones stood
};

class Crashes {
 public:
  // `kill`: nothing above the link exists any more, and nothing of it said goodbye. `replace`: a new bridge stands on
  // the same journal and link, and has taken over.
  Crashes(const world::Spells& spells, std::function<void()> kill, std::function<Expected<Above>(Time)> replace)
      : deaths_(spells), kill_(std::move(kill)), replace_(std::move(replace)) {}

  // Once a bridge period, before its tick. kFollows: the next one is there, as follower(). Error: there is none.
  [[nodiscard]] Expected<Deaths::Now> look(Time now) {
    const Deaths::Now is = deaths_.look(now);
    if (is == Deaths::Now::kDies) kill_();
    if (is != Deaths::Now::kFollows) return is;
    auto follower = replace_(now);
    if (!follower) return std::unexpected(follower.error());
    follower_ = *follower;
    return is;
  }
  [[nodiscard]] const Above& follower() const { return follower_; }
  [[nodiscard]] std::int64_t count() const { return deaths_.count(); }

 private:
  Deaths deaths_;
  std::function<void()> kill_;
  std::function<Expected<Above>(Time)> replace_;
  Above follower_;
};

}  // namespace pons::runner
