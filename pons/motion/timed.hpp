// Through given places at given times, as smoothly as can be. Pure functions, any thread; they allocate, and are not
// for a tick of the loop.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/motion/motion.hpp"

namespace pons::motion {

// Where to be, so long after the begin, and how fast. A speed that is not given is chosen.
struct TimedPoint {
  double time_s = 0;
  AxisVector position;  // rad, or m
  std::optional<AxisVector> speed;
};

inline constexpr double kShortestLeg_s = 0.001;  // a tick of the loop

enum class Shape : std::uint8_t {
  kSmooth,   // whatever that makes of the way between the points: they are close together
  kBetween,  // no axis goes beyond the points on either side, and one that is to stay stays; but as far as a speed that
             // is given asks for it
};

// From rest at `start` through `points` to rest at the last one: of all motions through them the one with the least
// squared jerk over time, axis by axis. It is a spline of quintics, one a leg, with continuous acceleration, and where
// nothing else is asked for of a point also jerk and its derivative: by integration by parts that is what makes the
// integral stationary (Flash and Hogan 1985, appendix A, for one via point). One system of equations with two unknowns
// a point, banded.
// kBetween: an axis that turns back at a point, or stays until the next one, has no speed there. Where it would go
// beyond its points all the same its speeds are the harmonic means of its legs' (Butland 1980), and where even that is
// not enough it has no acceleration there: with speeds of at most twice a leg's mean, a quintic is monotone then.
// Errors: no points, not finite, another number of axes, times that do not grow by kShortestLeg_s, a speed at the end.
[[nodiscard]] Expected<Trajectory> move_in_time(const AxisVector& start, Time at, std::span<const TimedPoint> points,
                                                Shape shape);

// `most` of the points or fewer, such that the motion through them is within so much of each of them at its time. The
// first has to be at 0: there it rests; it is kept, and so is the last. From two on, points are added where the motion
// is farthest off, leg by leg, as Ramer, Douglas and Peucker do for a line. Errors: those of move_in_time(); not so
// few.
[[nodiscard]] Expected<std::vector<TimedPoint>> thinned(std::span<const TimedPoint> points, Shape shape, double within,
                                                        std::size_t most);

// What a motion asks for beyond a limit.
struct Excess {
  enum class Of : std::uint8_t { kPosition, kSpeed, kAcceleration, kJerk };
  std::size_t point = 0;  // on the way to this one
  Eigen::Index axis = 0;
  Of of = Of::kSpeed;
  double use = 0;     // times its limit; of a position nothing
  double longer = 1;  // times as long the leg must take, if nothing else changes: slower by s, speeds are less by s,
                      // accelerations by its square, jerks by its cube
};
[[nodiscard]] std::string_view name(Excess::Of of);  // "speed", …

// Of each leg that is beyond a limit, in their order, the worst one. `trajectory` begins with the time of the points.
[[nodiscard]] std::vector<Excess> excesses(std::span<const Segment> trajectory, std::span<const TimedPoint> points,
                                           const AxisLimits& limits);

// Makes a motion through points at other times.
using InTime = std::function<Expected<Trajectory>(std::span<const TimedPoint>)>;

// The same places at times in which `make` keeps the limits: a leg that does not is given longer, by what its worst
// excess asks for, a few rounds long. With all legs so much longer as the worst then asks for, each round would do; the
// quickest is taken. No leg gets shorter. Speeds that were given get less with their legs. Errors: those of `make`; a
// position limit is not kept, which no time mends; the points are numbered from `first` on.
[[nodiscard]] Expected<std::vector<TimedPoint>> give_time(std::vector<TimedPoint> points, const InTime& make,
                                                          const AxisLimits& limits, std::size_t first = 1);
// All of it so many times as long.
void stretch(std::vector<TimedPoint>& points, double factor);

}  // namespace pons::motion
