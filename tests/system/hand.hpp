// How this test's skills move the arm: straight there, by the product's own arm and link.
#pragma once

#include "pons/skills/cell.hpp"
#include "tests/system/steps.hpp"

namespace pons::tests {

class Hand {
 public:
  // Both must outlive it.
  Hand(skills::Cell& cell, Steps& steps) : cell_(cell), steps_(steps) {}
  // To where the tip points down there, at rest. False: no way.
  [[nodiscard]] bool go(Time now, const Vector3& to);
  // Straight up, high enough for what hangs on the cups to pass over the belt. Likewise.
  [[nodiscard]] bool rise(Time now);
  [[nodiscard]] bool arrived(Time now) const;
  void vacuum(bool on);

 private:
  skills::Cell& cell_;
  Steps& steps_;
};

// Lays what nobody wants on the belt, to ride into the exception chute.
class LayDown {
 public:
  // Both must outlive it.
  LayDown(skills::Cell& cell, Steps& steps) : cell_(cell), hand_(cell, steps) {}
  // Once a period while nothing else moves the arm and something is held.
  void tick(Time now);

 private:
  enum class Phase : std::uint8_t { kRise, kCarry, kLower, kLetGo };
  skills::Cell& cell_;
  Hand hand_;
  Phase phase_ = Phase::kRise;
  Time last_, since_;
};

}  // namespace pons::tests
