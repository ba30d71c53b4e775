// What a learned policy says: where the arm shall be at each of the next few moments.
#pragma once

#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/time.hpp"

namespace pons {

// The actions of a stream stand `period` apart. How many have been executed is a real number: half way from the third
// to the fourth it is 3.5. A chunk holds a few actions in a row, and the arm is to be at its action j when observed + j
// + 1 have been executed. So it does not matter when a chunk arrives: what was executed meanwhile is left out.
struct Chunk {
  double observed = 0;              // actions that had been executed when the observation was made
  Duration period{0};               // at the policy's pace
  std::vector<AxisVector> actions;  // rad
  bool last = false;                // the stream ends with it
};

}  // namespace pons
