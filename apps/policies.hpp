// The policies that Pons brings along.
#pragma once

#include <string>
#include <vector>

#include "pons/brain/policy_runner.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// `world` and `model` must outlive what is made; a policy has a model of its own, for it may run on its own thread.
[[nodiscard]] brain::PolicyMakers policies_of(const world::World& world, const model::RobotModel& model);
[[nodiscard]] std::vector<std::string> policy_names();

}  // namespace pons::apps
