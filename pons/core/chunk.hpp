// What a learned policy says: where the arm shall be at each of the next few moments.
#pragma once

#include <cstdint>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/time.hpp"

namespace pons {

// The actions of a stream are numbered from 0 and stand `period` apart. A chunk holds a few of them in a row: its
// action j is action observed + j of the stream, and the arm is to be there when observed + j + 1 actions have been
// executed. So it does not matter when a chunk arrives: what was executed meanwhile is left out.
struct Chunk {
  std::int64_t observed = 0;        // actions that had been executed when the observation was made
  Duration period{0};               // at the policy's pace
  std::vector<AxisVector> actions;  // rad
  bool last = false;                // the stream ends with it
};

}  // namespace pons
