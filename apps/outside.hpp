// What skills that nodes of others serve ask of a run, and what becomes of them after another bridge.
#pragma once

#include <cstddef>
#include <optional>

#include "apps/ros_options.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/task/task.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Errors: the world has such skills, and the run is no node, or runs in virtual time, which others do not live in.
[[nodiscard]] Expected<void> check_outside(const world::World& world, const RosOptions& ros, runner::Pace pace);

// Of a task of whose steps so many were done when its bridge was ended. Nothing: the next step is none of these.
[[nodiscard]] std::optional<bridge::Resumption> outside_resumption(const gate::ros::OutsideSkills& skills,
                                                                   const task::Task& task, std::size_t done);

}  // namespace pons::apps
