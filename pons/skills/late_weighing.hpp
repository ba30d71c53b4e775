// Weighs what hangs on the cups, though its pick was broken off before it could.
#pragma once

#include <optional>

#include "pons/skills/cell.hpp"
#include "pons/skills/scale.hpp"
#include "pons/skills/set_down.hpp"

namespace pons::skills {

// What is held and was never weighed, because a stop broke off its lift. What may still stand on the belt is lifted
// free of it first, softly, for it may be heavy. The belt waits meanwhile.
class LateWeighing {
 public:
  explicit LateWeighing(Cell& cell) : cell_(cell) {}
  // Once a tick while nothing else moves the arm, until it is true: then the mass of what is held is known, as the most
  // that is carried where it could not be lifted; or nothing is held, for the cups have lost it, or it cannot be lifted
  // and was let go of where it stood. After a stop another one has to begin.
  [[nodiscard]] bool tick(Time now);
  // It is letting go of it: nobody else tells the arm anything.
  [[nodiscard]] bool lets_go() const { return lets_go_; }

 private:
  void lift_free(Time now);

  Cell& cell_;
  Scale scale_;
  SetDown set_down_{cell_};
  bool lets_go_ = false;
  std::optional<Time> rested_;  // hangs still by then
};

}  // namespace pons::skills
