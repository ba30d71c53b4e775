// What skills that nodes of others serve ask of a run, and what becomes of them after another bridge.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "apps/ros_options.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/task/task.hpp"
#include "pons/world/outside.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Errors: the world has such skills, and the run is no node, or runs in virtual time, which others do not live in.
[[nodiscard]] Expected<void> check_outside(const world::World& world, const RosOptions& ros, runner::Pace pace);

// Where the types of those skills are looked for that Pons was not built with: in the world's folders of interface
// files, then in the share/ of each prefix of AMENT_PREFIX_PATH, as nodes of this computer have them.
[[nodiscard]] std::vector<std::filesystem::path> interface_folders(const world::World& world);

// Whether one of those skills is served by an action or service of that name: then it is not for the run to serve, for
// of two servers each would take every goal.
[[nodiscard]] bool is_served_by_another(const gate::ros::Node& node, std::string_view name,
                                        const std::vector<world::OutsideSkill>& skills);

// Of a task of whose steps so many were done when its bridge was ended. Nothing: the next step is none of these.
[[nodiscard]] std::optional<bridge::Resumption> outside_resumption(const gate::ros::OutsideSkills& skills,
                                                                   const task::Task& task, std::size_t done);

}  // namespace pons::apps
