// For tests: skills that others serve, as a world's file says them.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/world/outside.hpp"
#include "pons/world/test_folder.hpp"
#include "pons/world/world.hpp"

namespace pons::gate::ros {

inline constexpr const char* kNavigateTo = R"(
  - name: navigate_to
    action: /navigate_to_pose
    type: nav2_msgs/action/NavigateToPose
    arguments: {x: {type: number, minimum: -50, maximum: 50}, y: number, yaw: {type: number, default: 0}}
    goal:
      pose:
        header: {frame_id: map}
        pose: {position: {x: "{x}", y: "{y}"}, orientation: "{quaternion(yaw)}"}
      behavior_tree: "by {x}"
    resources: [arm]
    timeout_s: 120
    feedback: [distance_remaining]
    reason: error_msg
)";
inline constexpr const char* kSwitch = R"(
  - name: switch
    service: /lamp
    type: std_srvs/srv/SetBool
    arguments: {on: boolean}
    request: {data: "{on}"}
    timeout_s: 10
    server_wait_s: 2
    success: success
    reason: message
)";

// What a world with `skills:` TEXT has of them.
inline Expected<std::vector<world::OutsideSkill>> outside_skills(const std::string& text) {
  const world::TestFolder folder;
  folder.write("cell/scene.xml", "<mujoco/>");
  folder.write("robots/ur5e/ur5e.urdf", "<robot/>");
  folder.write("robots/suction4/gripper.xml", "<mujoco/>");
  std::ifstream stream("worlds/parcel_cell/world.yaml", std::ios::binary);
  const std::string rest(std::istreambuf_iterator<char>(stream), {});
  folder.write("cell/world.yaml", rest + "\nskills:" + text);
  auto world = world::load(folder.path(), "cell");
  if (!world) return std::unexpected(world.error());
  return std::move(world->outside_skills);
}

}  // namespace pons::gate::ros
