// What nodes of ROS 2 ask of the robot: to stop, to be reset, to be armed. Everything happens on the node's thread;
// whoever polls the gate answers.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/std_srvs/srv/trigger.hpp"

namespace pons::apps {

class RosRobot {
 public:
  // `gate` is outlived by it, and has not been started.
  explicit RosRobot(gate::ros::Gate& gate) : gate_(gate) {}
  // The services ~/emergency_stop and ~/stop, which are answered as soon as the robot was told; ~/reset and ~/arm,
  // which are once its state shows it, or after kPatience that it does not; and the topic /emergency_stop, heard from
  // whoever publishes, reliably or not, on which true is an emergency stop and false nothing: as with a button on a
  // wall, letting go of it moves nothing and resets nothing, for others may have pressed theirs. Errors: those of
  // serve() and Node::subscribe_to_all().
  [[nodiscard]] Expected<void> serve();

 private:
  using Trigger = wire::std_srvs::srv::Trigger;
  using Clock = gate::ros::Part::Clock;
  using Waiting = std::vector<gate::ros::Answer<Trigger>>;
  // Whoever asks the same while the desk is asked gets that answer: what he asked for had not been done before.
  struct Verb {
    std::string_view name;  // of the service and the request
    gate::Urgency urgency;
    std::vector<std::string_view> shown_by = {};  // states; none: it is answered at once
    bool asked = false;
    Waiting waiting = {};
    std::size_t unanswered = 0;  // those who wait, and for whom the state is looked at
  };
  static constexpr std::size_t kUnansweredMost = 256;
  static constexpr std::chrono::milliseconds kPatience{1000}, kLook{20};
  // A button that stays pressed says so again and again.
  static constexpr std::chrono::milliseconds kPressedAgain{500};

  void ask(Verb& verb);
  // Answers, once the robot is as `verb` has it or `until` is over.
  void look(Verb& verb, const gate::Json& told, Waiting waiting, Clock::time_point until);
  static void answer(Verb& verb, const Waiting& waiting, bool success, const std::string& message);
  void pressed(Clock::time_point now);

  gate::ros::Gate& gate_;
  Verb emergency_stop_{"emergency_stop", gate::Urgency::kUrgent};
  Verb stop_{"stop", gate::Urgency::kUrgent};
  Verb reset_{"reset", gate::Urgency::kAny, {"disarmed"}};
  Verb arm_{"arm", gate::Urgency::kAny, {"operational", "recovery"}};
  Later* later_ = nullptr;
  bool is_pressed_ = false;
  Clock::time_point pressed_at_;
};

}  // namespace pons::apps
