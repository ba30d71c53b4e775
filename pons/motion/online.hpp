// Motion made while it is needed: from whatever state each axis is in to a target, as fast as speed, acceleration and
// jerk allow, for 1 to 16 axes and in a few microseconds. No allocation, no search that may fail, nothing kept between
// calls: the same tasks give the same motion, so a control loop may ask anew in every tick.
//
// A start beyond its bounds is brought back inside first, by the shortest motion that does it. From there on the bounds
// hold, each direction its own. Positions on the way are not bounded: ask AxisProfile::extent().
//
// Accuracy: ends within 1e-9 of position and speed, without acceleration, for motions of everyday size (positions
// below 1e3, durations below 1e3 s), bounds kept within 1e-9 of themselves; bench/trajectory_generation measures it.
#pragma once

#include <cstdint>
#include <expected>
#include <span>

#include "pons/motion/axis_plan.hpp"

namespace pons::motion {

inline constexpr std::size_t kMostTasks = 16;
inline constexpr double kLongestMotion_s = 1e6;  // what takes longer is a mistake

// Why there is no motion. None of them is met on the way: what gets past the checks is planned.
enum class OnlineError : std::uint8_t {
  kCount,      // no axis, more than kMostTasks, or another number of profiles than of tasks
  kNotFinite,  // a position, speed, acceleration, bound or duration that is no finite number
  kBounds,     // not minimum < 0 < maximum, jerk not positive, or a duration or grid below zero
  kEndSpeed,   // a target speed outside its bounds
  kTooLong,    // would take longer than kLongestMotion_s
};
[[nodiscard]] const char* text(OnlineError error);

// What the axes have to do with one another.
enum class Synchronization : std::uint8_t {
  kTime,   // all end at the same time, the slowest as fast as it can
  kPhase,  // on one straight line if start and target allow (all speeds and accelerations along it, and none that the
           // jerk of the slowest axis takes back too late), else as kTime
  kNone,   // each as fast as it can
};

// The durations do not concern kNone.
struct OnlineOptions {
  Synchronization synchronization = Synchronization::kTime;
  double least_s = 0;  // takes at least as long
  double grid_s = 0;   // the common duration is a multiple of this; 0: any
};

// To `end_position` with `end_speed` and no acceleration, all axes in the shortest common duration there is. Gives that
// duration (with kNone the longest one) and in `profiles` one motion an axis; an axis that comes to rest sooner than 20
// ns before the end may do so. Any thread; on an error the profiles are left as they were.
[[nodiscard]] std::expected<double, OnlineError> plan_positions(std::span<const AxisTask> tasks,
                                                                const OnlineOptions& options,
                                                                std::span<AxisProfile> profiles) PONS_NONBLOCKING;

// To `end_speed` and no acceleration, wherever that is (end_position is not read): for stopping, for jogging. The
// bounds of speed are those of `end_speed` alone: a start beyond them is not hurried back, the change of speed is the
// fastest anyhow. kTime: the others get as far on their way, in proportion, as the slowest axis, as nearly as they can.
[[nodiscard]] std::expected<double, OnlineError> plan_speeds(std::span<const AxisTask> tasks,
                                                             const OnlineOptions& options,
                                                             std::span<AxisProfile> profiles) PONS_NONBLOCKING;

}  // namespace pons::motion
