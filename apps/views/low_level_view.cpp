#include "apps/views/low_level_view.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace pons::apps {
namespace {

using link::SafetyState;
using wire::bridge_layer::msg::LowLevelCommand;

constexpr int kSamples = 32;  // of a motion, to see how fast the tip goes

// About: between those samples.
double fastest_m_s(const skills::Arm& arm, model::RobotModel& model, Time now) {
  const Duration step = (arm.motion_end() - now) / kSamples;
  if (step <= Duration{0}) return 0;
  double fastest = 0;
  Vector3 before = model.world_from_tip(arm.planned(now).position).translation();
  for (int i = 1; i <= kSamples; ++i) {
    const Vector3 at = model.world_from_tip(arm.planned(now + i * step).position).translation();
    fastest = std::max(fastest, (at - before).norm() / to_s(step));
    before = at;
  }
  return fastest;
}

}  // namespace

std::array<double, 6> six_numbers(const Pose& pose) {
  const Vector3 at = pose.translation();
  const Eigen::Matrix3d turn = pose.linear();
  return {at.x(),
          at.y(),
          at.z(),
          std::atan2(turn(2, 1), turn(2, 2)),
          std::atan2(-turn(2, 0), std::hypot(turn(0, 0), turn(1, 0))),
          std::atan2(turn(1, 0), turn(0, 0))};
}

std::uint64_t task_number(std::string_view id) {
  if (const auto colon = id.rfind(':'); colon != std::string_view::npos) id.remove_prefix(colon + 1);
  std::uint64_t number = 0;
  const auto [read, error] = std::from_chars(id.data(), id.data() + id.size(), number);
  return error == std::errc() && read == id.data() + id.size() ? number : 0;
}

Expected<std::unique_ptr<LowLevelView>> LowLevelView::open(Outlets& outlets, std::vector<Robot> robots) {
  auto view = std::make_unique<LowLevelView>();
  for (Robot& robot : robots) {
    const std::string space = robot.name.empty() ? "" : robot.name + "/";
    auto commands = outlets.outlet<LowLevelCommand>(space + "low_level_command");
    if (!commands) return std::unexpected(commands.error());
    view->robots_.push_back({.robot = std::move(robot), .commands = *commands});
  }
  return view;
}

void LowLevelView::show(Time now) {
  for (Shown& shown : robots_) {
    const link::State& state = shown.robot.arm->state();
    if (state.position.size() == 0) continue;  // nothing was measured yet
    const bool emergency =
        state.safety == SafetyState::kEmergencyStopping || state.safety == SafetyState::kEmergencyStop;
    const bool holds = state.vacuum_on != 0;
    const auto here = [&] { return shown.robot.model.world_from_tip(state.position); };
    if (!std::exchange(shown.emergency, emergency) && emergency)
      tell(shown, now, LowLevelCommand::EMERGENCY_STOP, here(), 0);
    if (std::exchange(shown.holds, holds) != holds)
      tell(shown, now, holds ? LowLevelCommand::GRASP : LowLevelCommand::RELEASE, here(), 0);
    tell_motion(shown, now);
  }
}

// One that was asked for since the last period: it ends at another time, or elsewhere.
void LowLevelView::tell_motion(Shown& shown, Time now) {
  const skills::Arm& arm = *shown.robot.arm;
  const Time end = arm.motion_end();
  if (end <= now) return;
  const AxisVector goal = arm.planned(end).position;
  const Time ends = end - arm.late();
  if (ends == shown.ends && shown.goal.size() == goal.size() && shown.goal == goal) return;
  shown.ends = ends;
  shown.goal = goal;
  tell(shown, now, shown.holds ? LowLevelCommand::MOVE_TO_PLACE : LowLevelCommand::MOVE_TO_PICK,
       shown.robot.model.world_from_tip(goal), fastest_m_s(arm, shown.robot.model, now));
}

void LowLevelView::tell(Shown& shown, Time now, std::uint8_t type, const Pose& world_from_tip, double max_speed_m_s) {
  shown.commands.put(now, {.task_id = task_number(shown.robot.task()),
                           .type = type,
                           .target_pose = six_numbers(world_from_tip),
                           .max_speed = max_speed_m_s});
}

}  // namespace pons::apps
