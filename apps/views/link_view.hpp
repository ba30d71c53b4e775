// What crosses the link: the commands that go down, and what the loop says of its robot beside the joint states.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/skills/arm.hpp"
#include "pons/wire/types/pons_msgs/msg/link_command.hpp"
#include "pons/wire/types/pons_msgs/msg/robot_state.hpp"

namespace pons::apps {

class LinkView final : public View {
 public:
  // The bridge's hand on a robot; it outlives this.
  struct Robot {
    std::string name;  // before its topics; empty where there is no other
    skills::Arm* hand = nullptr;
    std::string frame;     // of the tip's wrench
    std::size_t axes = 0;  // and
    std::size_t cups = 0;  // how many it has
  };
  // From here on each command is shown as it is sent. Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<LinkView>> open(Outlets& outlets, std::vector<Robot> robots);
  ~LinkView() override;
  LinkView(const LinkView&) = delete;
  LinkView& operator=(const LinkView&) = delete;

  void show(Time now) override;

 private:
  using Command = wire::pons_msgs::msg::LinkCommand;
  using State = wire::pons_msgs::msg::RobotState;
  struct Shown {
    Robot robot;
    Outlet<Command> commands;
    Outlet<State> states;
    Time stamp = Time(Duration::min());  // of what was shown last
    State message;
  };
  LinkView() = default;

  std::vector<std::unique_ptr<Shown>> robots_;
};

[[nodiscard]] wire::pons_msgs::msg::LinkCommand message_of(const link::Command& command, Time sent, std::size_t axes);
// All but the header's frame.
void put(const link::State& state, std::size_t cups, wire::pons_msgs::msg::RobotState& message);

}  // namespace pons::apps
