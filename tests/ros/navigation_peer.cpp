// A node that serves /navigate_to_pose, as Nav2 does, and drives nothing. Where the goal lies says what becomes of it:
// at x = 1 it is reached, at 2 there is no way, below 0 it is rejected; elsewhere it goes on until it is cancelled.
// What it hears it prints, a line each.
//
// usage: navigation_peer DOMAIN NODE ROLE    ROLE: jazzy or humble, whose form of the action it has; ends when its
// input does
#include <poll.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <utility>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/wire/types/nav2_msgs/action/navigate_to_pose.hpp"
#include "pons/wire/types/nav2_msgs_humble/action/navigate_to_pose.hpp"

namespace pons::gate::ros {
namespace {

using namespace std::chrono_literals;

void say(const std::string& line) {
  std::puts(line.c_str());
  std::fflush(stdout);
}

template <Action A>
class Navigation {
 public:
  [[nodiscard]] Expected<void> open(Node& node) {
    auto server = serve_action<A>(
        node, "/navigate_to_pose", [this](const GoalId& id, const typename A::Goal& goal) { take(id, goal); },
        [this](const GoalId& id) {
          say("cancel");
          goals_[id].cancelled = true;
          return true;
        });
    if (!server) return std::unexpected(server.error());
    server_ = *server;
    return {};
  }
  void go_on() {
    for (auto each = goals_.begin(); each != goals_.end();) {
      const auto& [id, goal] = *each;
      const auto status = goal.cancelled  ? GoalStatus::STATUS_CANCELED
                          : goal.x_m == 1 ? GoalStatus::STATUS_SUCCEEDED
                          : goal.x_m == 2 ? GoalStatus::STATUS_ABORTED
                                          : GoalStatus::STATUS_EXECUTING;
      typename A::Feedback feedback;
      feedback.distance_remaining = static_cast<float>(goal.x_m);
      server_->tell(id, feedback);
      if (!Goals::ended(status)) {
        ++each;
        continue;
      }
      typename A::Result result;
      if constexpr (requires { result.error_msg; }) {
        if (status == GoalStatus::STATUS_ABORTED) result.error_code = 208, result.error_msg = "there is no way";
      }
      server_->end(id, status, std::move(result));
      each = goals_.erase(each);
    }
  }

 private:
  struct Under {
    double x_m = 0;
    bool cancelled = false;
  };
  void take(const GoalId& id, const typename A::Goal& goal) {
    const double x_m = goal.pose.pose.position.x;
    say("goal " + std::to_string(x_m) + " in " + goal.pose.header.frame_id);
    if (x_m < 0) return server_->reject(id);
    server_->accept(id);
    goals_[id] = {x_m};
  }

  ActionServer<A>* server_ = nullptr;
  std::map<GoalId, Under> goals_;
};

template <Action A>
int serve_navigation(const NodeSettings& settings) {
  auto node = Node::open(settings);
  if (!node) return say(node.error().line()), 1;
  Navigation<A> navigation;
  if (auto opened = navigation.open(**node); !opened) return say(opened.error().line()), 1;
  say("here");
  for (pollfd input{STDIN_FILENO, POLLIN, 0}; ::poll(&input, 1, 0) == 0;) {
    (*node)->spin_for(50ms);
    navigation.go_on();
  }
  return 0;
}

}  // namespace
}  // namespace pons::gate::ros

int main(int count, char** words) {
  using namespace pons;
  std::uint32_t domain = 0;
  if (count != 4 || std::from_chars(words[1], words[1] + std::strlen(words[1]), domain).ec != std::errc()) return 2;
  const gate::ros::NodeSettings settings{.participant = {.domain = domain}, .name = {"/", words[2]}, .remaps = {}};
  return std::string(words[3]) == "humble"
             ? gate::ros::serve_navigation<wire::nav2_msgs_humble::action::NavigateToPose>(settings)
             : gate::ros::serve_navigation<wire::nav2_msgs::action::NavigateToPose>(settings);
}
