// follow_trajectory: moves the joints through given positions at given times, as ROS 2's FollowJointTrajectory asks.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

inline constexpr std::size_t kMostTrajectoryPoints = 200;  // each is a piece of motion; the loop queues 256 of them

// Arguments {"joints": names, "points": [{"positions": rad, "time_s": s, "velocities": rad/s}, …], "goal_tolerance":
// rad, "path_tolerance": rad, "goal_time_tolerance": s}; velocities may be left out of any point, the tolerances too.
// Every joint of the arm exactly once, in any order. The motion is motion::move_in_time(), and ends at rest. Its first
// point is reached from wherever the arm rests; or is where it has to rest, if its time is 0, as MoveIt's is.
// Ends kSucceeded when each joint is measured within the tolerance of the last point. How it is followed:
// timed_way.hpp.
[[nodiscard]] task::SkillType follow_trajectory(Cell& cell);

}  // namespace pons::skills
