// Tasks for bench/trajectory_generation, drawn by seed, and what a motion must satisfy to count as right.
#pragma once

#include <cstdint>
#include <expected>
#include <span>
#include <string>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/motion/online.hpp"

namespace pons::bench {

enum class Kind : std::uint8_t {
  kRandom,  // moderate states and symmetric bounds, as trajectory generators are usually measured: positions normal
            // with 4, speeds and accelerations normal with 0.8 or zero, bounds uniform in [0.08, 16); some starts are
            // beyond
  kHard,    // whatever is on an edge: bounds over nine decades, each direction its own, starts on and beyond them, ways
            // of nothing or next to it, end speeds on their bounds, units that differ by 10⁶ between axes
};

void draw(Random& random, Kind kind, std::span<motion::AxisTask> tasks);

// The worst of what was seen. Ends: how far off in position, speed and acceleration; beyond: bounds of speed and
// acceleration, relative to them, once the start is inside; seam: steps between phases, in position and speed.
struct Worst {
  double position = 0, speed = 0, acceleration = 0, beyond = 0, jerk = 0, seam = 0;

  void take(const Worst& other);
  [[nodiscard]] std::string line() const;
};

// What may be, for motions of everyday size. Of positions and speeds that are larger than one, 1e-13 more of
// themselves.
inline constexpr Worst kTolerance{1e-8, 1e-8, 1e-10, 1e-10, 1e-10, 1e-9};

// Whether each motion ends where and as it should, after duration_s, and holds its bounds on the way; what was seen is
// added to `worst`. Without `together` it may end sooner.
enum class End : std::uint8_t { kTogether, kAlone };
[[nodiscard]] bool is_right(std::span<const motion::AxisTask> tasks, std::span<const motion::AxisProfile> profiles,
                            double duration_s, End end, Worst& worst);

// One task in a line, for looking into it.
[[nodiscard]] std::string line(const motion::AxisTask& task);

}  // namespace pons::bench
