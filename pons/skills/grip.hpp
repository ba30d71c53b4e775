// How much a motion uses up of what the cups can hold and of what the motors can give.
#pragma once

#include "pons/model/robot_model.hpp"
#include "pons/motion/motion.hpp"
#include "pons/skills/route.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// The largest share of a cup's force that `trajectory` asks for, were the load rigid: each cup pulls what gravity and
// inertia ask of it (the load is a box of even density; its moment shared out as over a rigid plate of equal springs),
// and shear counts as the pull that friction needs to bear it. Above 1 the load comes off.
[[nodiscard]] double grip_use(model::RobotModel& model, const world::Tool& tool, const Load& load, double mass_kg,
                              const motion::Trajectory& trajectory);

// The largest share of a motor's torque limit that `trajectory` asks for with the load, were it rigid.
[[nodiscard]] double torque_use(model::RobotModel& model, const world::Robot& robot, const Load& load, double mass_kg,
                                const motion::Trajectory& trajectory);

}  // namespace pons::skills
