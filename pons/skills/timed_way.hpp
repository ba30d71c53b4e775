// What follow_trajectory and follow_path share: the arm goes through points at times that somebody else has chosen.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/motion/timed.hpp"
#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

inline constexpr double kLongestWay_s = 300;
inline constexpr const char* kTimeTolerance = "goal_time_tolerance";

// What differs between them.
struct TimedWay {
  std::vector<motion::TimedPoint> points;  // times count from when the arm sets out
  // Where the arm has to rest when it sets out, rad; then that is point 1 in what is said, and `points` come after it.
  std::optional<AxisVector> begins;
  double path_tolerance_rad = std::numeric_limits<double>::infinity();  // of each axis, on the way
  // By so much later than at the last point's time the arm may be at its end. None: the times are kept.
  std::optional<double> goal_time_tolerance_s = {};
  // A motion of the joints through such points, from rest at `start` (rad). Begins at Time{}.
  std::function<Expected<motion::Trajectory>(const AxisVector& start, std::span<const motion::TimedPoint> points)> make;
  // Whether the arm, measured there (rad), is where it was to end. Error: how far off it is.
  std::function<Expected<void>(const AxisVector& measured, const AxisVector& planned)> arrived;
};

// A skill of that kind, of whose arguments `read` makes the way, or says what is wrong with them. It waits for rest;
// plans; looks at all of the way, some of it a tick, and at what is ahead of it while it goes (Router::judge()); sees
// that the arm has arrived. A way that cannot be gone in its times, or is not clear, is refused before anything moves:
// by point and axis, with the least time; but it takes as much longer as limits ask for and its argument
// "goal_time_tolerance" (s) allows, which both skills have. One that says where it begins, and meets what stands there
// for good, is refused with its task. What is left of that tolerance, or half a second where the times are kept, the
// arm has to come to its end. Paused or stopped, it goes on from where the arm then stands along the rest, with what
// longer times that takes; where somebody else has had it, from where it had left off.
struct TimedSkill {
  std::string name, summary;
  task::Json schema;
  Expected<TimedWay> (*read)(Cell& cell, const task::Json& arguments);
};
[[nodiscard]] task::SkillType timed_skill(Cell& cell, TimedSkill skill);

// Whether times make sense by themselves: they grow, by a tick of the loop at least, and do not end too late. The
// points before `first` are where the arm begins.
[[nodiscard]] Expected<void> check_times(std::span<const motion::TimedPoint> points, std::size_t first = 0);

}  // namespace pons::skills
