// follow_path: moves the tool tip through given places at given times.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

inline constexpr std::size_t kMostPathPoints = 50;

// Arguments {"points": [{"position": [x, y, z] (m, world frame), "time_s": s}, …], "goal_tolerance": m,
// "goal_time_tolerance": s}; the tolerances may be left out. The tip's way between them is motion::move_in_time() of
// each coordinate; the tool keeps the turn that it has when it sets out, and points down (where it did not, from the
// first point on). Joints follow on the branch that the arm is on. Ends kSucceeded when the tip is measured within the
// tolerance of the last point. How it is followed: timed_way.hpp.
[[nodiscard]] task::SkillType follow_path(Cell& cell);

}  // namespace pons::skills
