// A bridge that is killed within a run in lockstep, as `kill -9` kills one in a process of its own, and the next one
// that takes over from its journal. A fault (docs/decisions/0029-faults-as-data.md); who really has two processes kills
// one of them.
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

class Crashes {
 public:
  // `kill`: nothing above the link exists any more, and nothing of it said goodbye. `replace`: a new bridge stands on
  // the same journal and link, and has taken over.
  Crashes(const world::Spells& spells, std::function<void()> kill, std::function<Expected<Above>(Time)> replace)
      : spells_(spells), kill_(std::move(kill)), replace_(std::move(replace)) {}

  // Once a bridge period, before its tick.
  enum class Now : std::uint8_t {
    kLives,
    kDies,  // in this period
    kDead,
    kFollows,  // the next one is there: follower()
  };
  // Error: there is none to follow.
  [[nodiscard]] Expected<Now> look(Time now) {
    const bool dead = spells_.on(now);
    const bool was = std::exchange(dead_, dead);
    if (dead && !was) kill_();
    if (dead) return was ? Now::kDead : Now::kDies;
    if (!was) return Now::kLives;
    auto follower = replace_(now);
    if (!follower) return std::unexpected(follower.error());
    follower_ = *follower;
    return Now::kFollows;
  }
  [[nodiscard]] const Above& follower() const { return follower_; }
  [[nodiscard]] std::int64_t count() const { return spells_.begun(); }

 private:
  world::Spells spells_;
  std::function<void()> kill_;
  std::function<Expected<Above>(Time)> replace_;
  Above follower_;
  bool dead_ = false;
};

}  // namespace pons::runner
