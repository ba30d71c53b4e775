// The tool on a straight line through the world, whatever that asks of the joints.
#pragma once

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/motion.hpp"

namespace pons::motion {

// Of the tip: along the line, and of its turn about one axis.
struct TipLimits {
  double speed_m_s = 1.0, acceleration_m_s2 = 8, jerk_m_s3 = 160;
  double turn_rad_s = 3.0, turn_acceleration_rad_s2 = 20, turn_jerk_rad_s3 = 400;
};

// What one line may cost: poses that joint angles are sought for, or that are looked at, at most. With them the slowest
// line takes some 30 ms, so that a tick of the bridge can plan one.
inline constexpr int kMostPoses = 10'000;

struct Line {
  Trajectory trajectory;
  // No motion along this line is faster: the time that it takes with every joint's and the tip's speed limit kept and
  // no other, and, at rest at both ends, by acceleration and jerk of the tip.
  double least_s = 0;
  int poses = 0;  // that it cost
};

// From rest at `start` (rad) to rest at `world_from_tip`: position on a straight line, orientation by SLERP (Shoemake
// 1985), both by one share of the way. Joints follow by inverse kinematics on the branch that the arm is on, and each
// keeps its limits, so near a singularity the tool slows down. Off the line by 0.1 mm and 0.01° at most.
//
// The pace: along the line, in units of what speed limits alone would take, speed is capped by what each joint's speed,
// acceleration and jerk allow for the line's bends; forward and backward passes keep accelerations (Bobrow, Dubowsky
// and Gibson 1985); averages over time keep jerks (Biagiotti and Melchiorri 2012); where the outcome is beyond a limit,
// the caps are lowered and all of it is done again.
//
// Errors: start or goal not finite or not in reach, limits not positive; the line leaves reach or position limits, or
// runs through a singularity, where a joint would have to jump or the branch would have to change: each with how far
// along the line that is; it would take too long, or cost more than `most_poses`. Any thread that owns the model.
[[nodiscard]] Expected<Line> move_line(model::RobotModel& model, const AxisVector& start, Time at,
                                       const Pose& world_from_tip, const AxisLimits& limits, const TipLimits& tip,
                                       int most_poses = kMostPoses);

}  // namespace pons::motion
