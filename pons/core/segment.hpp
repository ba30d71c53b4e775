// The unit of motion that crosses the link: every axis follows one polynomial for a while.
#pragma once

#include <array>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons {

// position(t) = Σ c[k]·(t − start)^k, k = 0…5, t in seconds. Constant-jerk motion uses k ≤ 3. Fixed size, trivially
// copyable: it may cross shared memory. Unused axes are zero.
struct Segment {
  Time start;
  Duration duration{0};
  std::array<std::array<double, 6>, kMaxAxes> coefficients{};

  [[nodiscard]] constexpr Time end() const { return start + duration; }
};

// The motion at `time`, clamped to the segment's own span; `state` must already have the robot's axis count.
inline void sample(const Segment& segment, Time time, AxisState& state) PONS_NONBLOCKING {
  const Duration span = time - segment.start;
  const double t = to_s(span < Duration{0} ? Duration{0} : (span > segment.duration ? segment.duration : span));
  for (Eigen::Index axis = 0; axis < state.position.size(); ++axis) {
    const auto& c = segment.coefficients[static_cast<std::size_t>(axis)];
    state.position[axis] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    state.speed[axis] = c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])));
    state.acceleration[axis] = 2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5]));
  }
}

}  // namespace pons
