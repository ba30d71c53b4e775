#include "apps/views/link_view.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "pons/gate/ros/action.hpp"
#include "pons/wire/types/builtin_interfaces/msg/duration.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::pons_msgs::msg::LinkCommand;
using wire::pons_msgs::msg::RobotState;

// The pieces of a motion go out in one period.
constexpr gate::ros::Qos kCommandsQos{.depth = 200};

wire::builtin_interfaces::msg::Duration ros_duration(Duration duration) {
  const auto [sec, nanosec] = ros_stamp(duration.count());
  return {sec, nanosec};
}

void put(const AxisVector& from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

wire::geometry_msgs::msg::Wrench wrench_of(const std::array<double, 6>& wrench) {
  return {{wrench[0], wrench[1], wrench[2]}, {wrench[3], wrench[4], wrench[5]}};
}

// The messages' numbers are those of the link's own.
template <typename T>
constexpr std::uint8_t number(T value) {
  return static_cast<std::uint8_t>(value);
}
static_assert(number(link::CommandKind::kBelt) == LinkCommand::KIND_BELT);
static_assert(number(link::CommandKind::kReset) == LinkCommand::KIND_RESET);
static_assert(number(link::Controller::kAdmittance) == LinkCommand::CONTROLLER_ADMITTANCE);
static_assert(number(link::Belt::kWaits) == LinkCommand::BELT_WAITS);
static_assert(number(link::SafetyState::kRecovery) == RobotState::SAFETY_RECOVERY);
static_assert(number(link::StopCause::kCollision) == RobotState::CAUSE_COLLISION);
static_assert(number(link::StopCause::kBodySilent) == RobotState::CAUSE_BODY_SILENT);
static_assert(number(link::StopResult::kFailed) == RobotState::STOP_FAILED);
static_assert(number(link::VacuumPhase::kReleasing) == RobotState::VACUUM_RELEASING);

}  // namespace

LinkCommand message_of(const link::Command& command, Time sent, std::size_t axes) {
  LinkCommand message;
  message.stamp = ros_stamp(sent.ns());
  message.sequence = command.sequence;
  message.epoch = command.epoch;
  message.kind = number(command.kind);
  switch (command.kind) {
    case link::CommandKind::kMotion:
      message.splice = command.splice;
      message.start = ros_stamp(command.segment.start.ns());
      message.duration = ros_duration(command.segment.duration);
      for (std::size_t axis = 0; axis < axes; ++axis)
        message.coefficients.insert(message.coefficients.end(), command.segment.coefficients[axis].begin(),
                                    command.segment.coefficients[axis].end());
      break;
    case link::CommandKind::kVacuum:
      message.vacuum_on = command.vacuum_on;
      break;
    case link::CommandKind::kPayload:
      message.payload = command.payload_kg;
      message.payload_com = {command.payload_com_m[0], command.payload_com_m[1], command.payload_com_m[2]};
      break;
    case link::CommandKind::kContact:
      message.contact = command.contact_n;
      break;
    case link::CommandKind::kControl:
      message.controller = number(command.controller);
      message.stiffness = command.compliance.stiffness;
      message.damping = command.compliance.damping;
      message.wrench = command.compliance.wrench;
      message.force_max = command.compliance.force_max_n;
      break;
    case link::CommandKind::kBelt:
      message.belt = number(command.belt);
      break;
    default:
      break;
  }
  return message;
}

void put(const link::State& state, std::size_t cups, RobotState& message) {
  message.header.stamp = ros_stamp(state.stamp.ns());
  message.tick = state.tick;
  message.epoch = state.epoch;
  message.last_sequence = state.last_sequence;
  message.dropped = state.dropped;
  message.safety = number(state.safety);
  message.cause = number(state.cause);
  message.stop_result = number(state.stop_result);
  message.motion_end = ros_stamp(state.motion_end.ns());
  put(state.commanded.position, message.commanded_position);
  put(state.commanded.speed, message.commanded_velocity);
  put(state.external_nm, message.external_torque);
  message.tip_wrench = wrench_of(state.tip_wrench);
  message.wrist_wrench = wrench_of(state.wrist_wrench);
  message.cup_vacuum.assign(
      state.cup_vacuum_kpa.begin(),
      state.cup_vacuum_kpa.begin() + static_cast<std::ptrdiff_t>(std::min(cups, state.cup_vacuum_kpa.size())));
  message.vacuum_on = state.vacuum_on;
  message.vacuum = number(state.vacuum.phase);
  message.sealed_cups = state.vacuum.sealed_cups;
  message.vacuum_open = state.vacuum.open;
  message.controller = number(state.controller);
  message.belt = number(state.belt);
  message.belt_travel = state.belt_travel_m;
  message.belt_speed = state.belt_speed_m_s;
  message.photo_eye_blocked = state.photo_eye_blocked;
  message.watchdog_tripped = state.watchdog_tripped;
  message.zones_occupied = state.zones_occupied;
  message.zones_entered = state.zones_entered;
  message.speed_share = state.speed_share;
  message.rate = state.rate;
  message.late = ros_duration(state.late);
}

Expected<std::unique_ptr<LinkView>> LinkView::open(Outlets& outlets, std::vector<Robot> robots) {
  std::unique_ptr<LinkView> view(new LinkView);
  for (Robot& robot : robots) {
    const std::string space = "~/" + (robot.name.empty() ? "" : robot.name + "/");
    auto commands = outlets.outlet<Command>(space + "commands", kCommandsQos);
    if (!commands) return std::unexpected(commands.error());
    auto states = outlets.outlet<State>(space + "state");
    if (!states) return std::unexpected(states.error());
    auto shown = std::make_unique<Shown>(Shown{std::move(robot), *commands, *states, Time(Duration::min()), {}});
    shown->message.header.frame_id = shown->robot.frame;
    shown->robot.hand->show_sent([to = shown.get()](Time sent, const link::Command& command) {
      if (to->commands.wanted()) to->commands.put(sent, message_of(command, sent, to->robot.axes));
    });
    view->robots_.push_back(std::move(shown));
  }
  return view;
}

LinkView::~LinkView() {
  for (const auto& shown : robots_) shown->robot.hand->show_sent({});
}

void LinkView::show(Time now) {
  for (const auto& shown : robots_) {
    const link::State& state = shown->robot.hand->state();
    if (state.position.size() == 0 || state.stamp == shown->stamp) continue;  // nothing new was measured
    shown->stamp = state.stamp;
    if (!shown->states.wanted()) continue;
    put(state, shown->robot.cups, shown->message);
    shown->states.put(now, shown->message);
  }
}

}  // namespace pons::apps
