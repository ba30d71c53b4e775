// Inside motion and for skills: joint angles along a way of the tool.
#pragma once

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::motion {

// Joint angles (rad) for a pose close to one whose angles are `near`, on the same branch. Of a redundant arm the
// nearest ones, by Newton's method: its inverse kinematics may choose others from pose to pose, and what follows a way
// must not. Errors: out of reach, beyond a position limit. Any thread.
[[nodiscard]] Expected<AxisVector> angles_near(const model::RobotModel& model, const Pose& world_from_tip,
                                               const AxisVector& near);

}  // namespace pons::motion
