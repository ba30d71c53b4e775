#include "apps/ros_lifecycle.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string_view>
#include <utility>

#include "pons/gate/ros/action.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_available_states.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_available_transitions.hpp"
#include "pons/wire/types/lifecycle_msgs/srv/get_state.hpp"

namespace pons::apps {
namespace {

using gate::Json;
using gate::ros::Answer;
using wire::lifecycle_msgs::msg::State;
using wire::lifecycle_msgs::msg::Transition;
using wire::lifecycle_msgs::srv::GetAvailableStates;
using wire::lifecycle_msgs::srv::GetAvailableTransitions;
using wire::lifecycle_msgs::srv::GetState;

constexpr std::array<std::pair<std::uint8_t, std::string_view>, 6> kStates{
    {{State::PRIMARY_STATE_INACTIVE, "inactive"},
     {State::PRIMARY_STATE_ACTIVE, "active"},
     {State::PRIMARY_STATE_FINALIZED, "finalized"},
     {State::TRANSITION_STATE_SHUTTINGDOWN, "shuttingdown"},
     {State::TRANSITION_STATE_ACTIVATING, "activating"},
     {State::TRANSITION_STATE_DEACTIVATING, "deactivating"}}};

// Those that somebody may ask for; labels are rclcpp_lifecycle's.
struct Way {
  std::uint8_t id;
  std::string_view label;
  std::uint8_t from, through, to;
  const char* operation;  // of pons/gate/request.hpp
};
constexpr std::array kWays{Way{Transition::TRANSITION_ACTIVATE, "activate", State::PRIMARY_STATE_INACTIVE,
                               State::TRANSITION_STATE_ACTIVATING, State::PRIMARY_STATE_ACTIVE, "go_on"},
                           Way{Transition::TRANSITION_DEACTIVATE, "deactivate", State::PRIMARY_STATE_ACTIVE,
                               State::TRANSITION_STATE_DEACTIVATING, State::PRIMARY_STATE_INACTIVE, "rest"},
                           Way{Transition::TRANSITION_INACTIVE_SHUTDOWN, "shutdown", State::PRIMARY_STATE_INACTIVE,
                               State::TRANSITION_STATE_SHUTTINGDOWN, State::PRIMARY_STATE_FINALIZED, "end"},
                           Way{Transition::TRANSITION_ACTIVE_SHUTDOWN, "shutdown", State::PRIMARY_STATE_ACTIVE,
                               State::TRANSITION_STATE_SHUTTINGDOWN, State::PRIMARY_STATE_FINALIZED, "end"}};

constexpr std::chrono::milliseconds kAtOnce{0}, kLooksAgain{100};

State state_message(std::uint8_t id) {
  const auto* const known = std::ranges::find(kStates, id, &decltype(kStates)::value_type::first);
  return {.id = id, .label = std::string(known == kStates.end() ? "unknown" : known->second)};
}

const Way* way_of(std::uint8_t id) {
  const auto* const found = std::ranges::find(kWays, id, &Way::id);
  return found == kWays.end() ? nullptr : found;
}

wire::lifecycle_msgs::msg::TransitionDescription described(const Way& way) {
  return {.transition = {.id = way.id, .label = std::string(way.label)},
          .start_state = state_message(way.from),
          .goal_state = state_message(way.to)};
}

// As rclcpp_lifecycle has it: by the label, where there is one.
const Way* asked_for(const Transition& asked, std::uint8_t from) {
  const auto* const found = std::ranges::find_if(kWays, [&](const Way& way) {
    return way.from == from && (asked.label.empty() ? way.id == asked.id : way.label == asked.label);
  });
  return found == kWays.end() ? nullptr : found;
}

}  // namespace

Expected<void> RosLifecycle::serve() {
  auto later = std::make_unique<Later>();
  later_ = later.get();
  gate_.node().add_part(std::move(later));
  later_->put(kAtOnce, [this] { recall(); });
  auto events = gate_.node().advertise<Event>("~/transition_event");
  if (!events) return std::unexpected(events.error());
  events_.emplace(*std::move(events));
  auto served = gate::ros::serve<ChangeState>(
      gate_.node(), "~/change_state",
      [this](const ChangeState::Request& request, const Answer<ChangeState>& answer) { change(request, answer); });
  return served ? serve_looks() : served;
}

Expected<void> RosLifecycle::serve_looks() {
  gate::ros::Node& node = gate_.node();
  auto served = gate::ros::serve<GetState>(node, "~/get_state", [this](const auto&, const auto& answer) {
    answer({.current_state = state_message(state_)});
  });
  if (!served) return served;
  served = gate::ros::serve<GetAvailableStates>(node, "~/get_available_states", [](const auto&, const auto& answer) {
    GetAvailableStates::Response response;
    for (const auto& [id, label] : kStates) response.available_states.push_back(state_message(id));
    answer(response);
  });
  if (!served) return served;
  served = gate::ros::serve<GetAvailableTransitions>(node, "~/get_available_transitions",
                                                     [this](const auto&, const auto& answer) {
                                                       GetAvailableTransitions::Response response;
                                                       for (const Way& way : kWays)
                                                         if (way.from == state_)
                                                           response.available_transitions.push_back(described(way));
                                                       answer(response);
                                                     });
  if (!served) return served;
  return gate::ros::serve<GetAvailableTransitions>(node, "~/get_transition_graph", [](const auto&, const auto& answer) {
    GetAvailableTransitions::Response response;
    for (const Way& way : kWays) response.available_transitions.push_back(described(way));
    answer(response);
  });
}

// Nobody has changed anything then: it is no transition, and no event.
void RosLifecycle::recall() {
  gate_.ask(Json{{"op", "robot"}}, [this](const Json& told) {
    const bool untouched = !changing_ && state_ == State::PRIMARY_STATE_ACTIVE;
    if (untouched && told.value("rests", false)) state_ = State::PRIMARY_STATE_INACTIVE;
  });
}

// What does not lead on from here, or while another one is under way, is refused.
void RosLifecycle::change(const ChangeState::Request& request, const Answer<ChangeState>& answer) {
  const Way* const way = changing_ ? nullptr : asked_for(request.transition, state_);
  if (way == nullptr) return answer({.success = false});
  changing_ = {.transition = way->id, .from = way->from, .to = way->to, .answer = answer, .since = Clock::now()};
  become(way->through, way->id);
  ask(way->operation);
}

void RosLifecycle::ask(const char* operation) {
  gate_.ask(Json{{"op", operation}}, [this](const Json& told) {
    if (!changing_) return;
    if (!told.value("ok", false)) {
      gate_.node().warn("lifecycle: " + told.value("error", "no answer"));
      return end(false, changing_->from);
    }
    if (changing_->transition == Transition::TRANSITION_DEACTIVATE && !told.value("rests", false)) return deactivate();
    end(true, changing_->to);
  });
}

// What runs has not come to stand yet.
void RosLifecycle::deactivate() {
  if (Clock::now() - changing_->since < kStandsWithin)
    return later_->put(kLooksAgain, [this] {
      if (changing_) ask("rest");
    });
  gate_.node().warn("lifecycle: it was not deactivated: a task did not come to stand");
  gate_.ask(Json{{"op", "go_on"}}, [](const Json&) {});
  end(false, changing_->from);
}

void RosLifecycle::end(bool success, std::uint8_t state) {
  const Changing changed = *std::exchange(changing_, std::nullopt);
  become(state, changed.transition);
  changed.answer({.success = success});
}

void RosLifecycle::become(std::uint8_t state, std::uint8_t transition) {
  const std::uint8_t from = std::exchange(state_, state);
  const Way* const way = way_of(transition);
  Event event{.timestamp = static_cast<std::uint64_t>(gate_.node().stamp_ns()),
              .transition = {.id = transition, .label = way == nullptr ? "" : std::string(way->label)},
              .start_state = state_message(from),
              .goal_state = state_message(state)};
  if (const auto told = events_->publish(event); !told) gate_.node().warn(told.error().line());
}

}  // namespace pons::apps
