// What the bridge commands an arm, step by step, in the words of bridge_layer/LowLevelCommand: each motion by where the
// tool's tip comes to rest, and each change of the cups. It is told, and nobody need do it: the cerebellum has done so.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/skills/arm.hpp"
#include "pons/wire/types/bridge_layer/msg/low_level_command.hpp"

namespace pons::apps {

class LowLevelView final : public View {
 public:
  struct Robot {
    std::string name;  // before its topic; empty where there is no other
    const skills::Arm* arm;
    model::RobotModel model;
    std::function<std::string()> task;  // the id of the one that moves it now; empty: none does
  };
  // What `robots` name outlives it. Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<LowLevelView>> open(Outlets& outlets, std::vector<Robot> robots);
  // A motion that was replaced within one period is not told.
  void show(Time now) override;

 private:
  using LowLevelCommand = wire::bridge_layer::msg::LowLevelCommand;
  struct Shown {
    Robot robot;
    Outlet<LowLevelCommand> commands;
    AxisVector goal = {};  // of the motion that was told last
    Time ends = {};        // likewise, in the motion's own time
    bool holds = false;    // the cups are on
    bool emergency = false;
  };
  static void tell(Shown& shown, Time now, std::uint8_t type, const Pose& world_from_tip, double max_speed_m_s);
  static void tell_motion(Shown& shown, Time now);

  std::vector<Shown> robots_;
};

// [x y z roll pitch yaw]: m; rad about the fixed axes x, y, z in this order.
[[nodiscard]] std::array<double, 6> six_numbers(const Pose& pose);

// The number of a task for those who have numbers: its id where that is one, or what follows its last colon; 0: it has
// none.
[[nodiscard]] std::uint64_t task_number(std::string_view id);

}  // namespace pons::apps
