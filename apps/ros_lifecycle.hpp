// A run as a managed node (design.ros2.org, "Managed nodes"): it is active from its beginning, may be deactivated and
// activated, and shut down. Everything happens on the node's thread; whoever polls the gate answers.
//
//   active     tasks are taken and begun
//   inactive   none is, the belt waits, and what ran stands at a safe point (pons/gate/request.hpp: rest)
//   finalized  the run ends as with Ctrl-C
//
// A bridge that follows another on the same run finds out what that one was told: of a run that rests it is inactive.
//
// Whether the robot itself is armed is another matter, which ~/arm and /diagnostics are for. A run was configured
// before its node was there, and cannot be without: there is no cleaning up.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "apps/ros_follow.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/lifecycle_msgs/msg/transition_event.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/change_state.hpp"

namespace pons::apps {

class RosLifecycle {
 public:
  // `gate` outlives it, and has not been started.
  explicit RosLifecycle(gate::ros::Gate& gate) : gate_(gate) {}
  // ~/change_state, ~/get_state, ~/get_available_states, ~/get_available_transitions, ~/get_transition_graph, and the
  // topic ~/transition_event. Errors: those of serve() and Node::advertise().
  [[nodiscard]] Expected<void> serve();

 private:
  using ChangeState = wire::lifecycle_msgs::srv::ChangeState;
  using Event = wire::lifecycle_msgs::msg::TransitionEvent;
  using Clock = gate::ros::Part::Clock;
  // So long what runs may take to stand; then all goes on, and the node stays active.
  static constexpr std::chrono::seconds kStandsWithin{60};

  // One under way, and how it is answered.
  struct Changing {
    std::uint8_t transition = 0, from = 0, to = 0;
    gate::ros::Answer<ChangeState> answer;
    Clock::time_point since;
  };

  [[nodiscard]] Expected<void> serve_looks();
  void change(const ChangeState::Request& request, const gate::ros::Answer<ChangeState>& answer);
  void deactivate();
  void recall();
  void ask(const char* operation);
  void become(std::uint8_t state, std::uint8_t transition);
  void end(bool success, std::uint8_t state);

  gate::ros::Gate& gate_;
  Later* later_ = nullptr;
  std::uint8_t state_ = wire::lifecycle_msgs::msg::State::PRIMARY_STATE_ACTIVE;
  std::optional<Changing> changing_;
  std::optional<gate::ros::Publisher<Event>> events_;
};

}  // namespace pons::apps
