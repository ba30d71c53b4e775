// What the arm does while no skill moves it.
#pragma once

#include "pons/skills/late_weighing.hpp"
#include "pons/skills/set_down.hpp"

namespace pons::skills {

// Keeps clear of what comes along, and lays down what was left on the cups.
class Rest {
 public:
  explicit Rest(Cell& cell) : cell_(cell), set_down_(cell) {}
  // Once a period while no skill runs.
  void tick(Time now);
  // Likewise, and with empty cups it stands out of the cameras' view: what they show then, when they show anything
  // again, is the belt.
  void park(Time now);

 private:
  Cell& cell_;
  std::optional<LateWeighing> weighing_;
  SetDown set_down_;
  Time last_, since_, tried_;
  bool laying_ = false;
  bool parked_ = false;  // or on its way
};

}  // namespace pons::skills
