#include "apps/ros_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "pons/task/json_value.hpp"
#include "pons/wire/types/std_msgs/msg/bool.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using wire::std_msgs::msg::Bool;

}  // namespace

Expected<void> RosRobot::serve() {
  auto later = std::make_unique<Later>();
  later_ = later.get();
  gate_.node().add_part(std::move(later));
  for (Verb* const verb : {&emergency_stop_, &stop_, &reset_, &arm_}) {
    auto served =
        gate::ros::serve<Trigger>(gate_.node(), fmt::format("~/{}", verb->name),
                                  [this, verb](const Trigger::Request&, const gate::ros::Answer<Trigger>& answer) {
                                    if (verb->unanswered >= kUnansweredMost)
                                      return answer({.success = false, .message = "too many ask at once: ask again"});
                                    ++verb->unanswered;
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
  const auto answered = [this, &verb](const Json& told) {
    verb.asked = false;
    look(verb, told, std::exchange(verb.waiting, {}), Clock::now() + kPatience);
  };
  gate_.ask(Json{{"op", verb.name}}, answered, verb.urgency);
}

void RosRobot::look(Verb& verb, const Json& told, Waiting waiting, Clock::time_point until) {
  if (waiting.empty()) return;  // it was a button
  if (!told.value("ok", false)) return answer(verb, waiting, false, told.value("error", "no answer"));
  const std::string state = task::text_of(told.value("robot", Json::object()), "state");
  if (verb.shown_by.empty()) return answer(verb, waiting, true, "asked for; the robot's state was: " + state);
  if (std::ranges::find(verb.shown_by, state) != verb.shown_by.end())
    return answer(verb, waiting, true, "the robot's state is: " + state);
  if (Clock::now() >= until) return answer(verb, waiting, false, "asked for; the robot's state is still: " + state);
  later_->put(kLook, [this, &verb, waiting = std::move(waiting), until] {
    gate_.ask(Json{{"op", "robot"}}, [=, this, &verb](const Json& now) { look(verb, now, waiting, until); });
  });
}

void RosRobot::answer(Verb& verb, const Waiting& waiting, bool success, const std::string& message) {
  verb.unanswered -= waiting.size();
  for (const auto& each : waiting) each({.success = success, .message = message});
}

}  // namespace pons::apps
