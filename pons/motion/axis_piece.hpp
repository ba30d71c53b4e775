// One axis between two states that may both carry acceleration: a piece of a motion through via points.
#pragma once

#include "pons/motion/axis_plan.hpp"

namespace pons::motion {

struct AxisPiece {
  AxisPoint from, to;
  AxisBounds bounds;
};

// Time-optimal if either end has no acceleration. Otherwise the best of the motions that let go of all acceleration
// once on the way: then it may be longer than the optimum, and infinite where no such motion was found.
[[nodiscard]] double fastest_duration_s(const AxisPiece& piece) PONS_NONBLOCKING;

// The shortest duration from `duration_s` on in which the piece can be done; infinite if none was found.
[[nodiscard]] double possible_duration_s(const AxisPiece& piece, double duration_s) PONS_NONBLOCKING;

// The piece in exactly a possible duration.
[[nodiscard]] AxisProfile plan_in_time(const AxisPiece& piece, double duration_s) PONS_NONBLOCKING;

}  // namespace pons::motion
