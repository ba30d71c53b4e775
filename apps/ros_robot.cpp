#include "apps/ros_robot.hpp"

#include <fmt/format.h>

#include <utility>

#include "pons/task/json_value.hpp"
#include "pons/wire/types/std_msgs/msg/bool.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using wire::std_msgs::msg::Bool;

// For people: how the robot was when it was asked, for what comes of it takes a while; or why it is not as they wanted.
std::string message_of(const Json& told) {
  const Json robot = told.value("robot", Json::object());
  if (robot.empty()) return told.value("error", "no answer");
  return fmt::format("asked for; the robot's state was: {}", task::text_of(robot, "state"));
}

}  // namespace

Expected<void> RosRobot::serve() {
  for (Verb* const verb : {&emergency_stop_, &stop_, &reset_, &arm_}) {
    auto served =
        gate::ros::serve<Trigger>(gate_.node(), fmt::format("~/{}", verb->name),
                                  [this, verb](const Trigger::Request&, const gate::ros::Answer<Trigger>& answer) {
                                    if (verb->waiting.size() >= kWaitingMost)
                                      return answer({.success = false, .message = "too many ask at once: ask again"});
                                    verb->waiting.push_back(answer);
                                    ask(*verb);
                                  });
    if (!served) return served;
  }
  return gate_.node().subscribe_to_all<Bool>("/emergency_stop", [this](const Bool& button) {
    if (button.data) pressed(Clock::now());
    is_pressed_ = button.data;
  });
}

void RosRobot::pressed(Clock::time_point now) {
  if (is_pressed_ && now - pressed_at_ < kPressedAgain) return;
  pressed_at_ = now;
  ask(emergency_stop_);
}

void RosRobot::ask(Verb& verb) {
  if (std::exchange(verb.asked, true)) return;
  gate_.ask(Json{{"op", verb.name}}, [this, &verb](const Json& told) { answer(verb, told); }, verb.urgency);
}

void RosRobot::answer(Verb& verb, const Json& told) {
  verb.asked = false;
  for (const auto& each : std::exchange(verb.waiting, {}))
    each({.success = told.value("ok", false), .message = message_of(told)});
}

}  // namespace pons::apps
