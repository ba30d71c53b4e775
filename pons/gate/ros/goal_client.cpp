#include "pons/gate/ros/goal_client.hpp"

#include <algorithm>
#include <random>

#include "pons/wire/types/builtin_interfaces/msg/time.hpp"
#include "pons/wire/types/unique_identifier_msgs/msg/uuid.hpp"

namespace pons::gate::ros {
namespace {

using wire::unique_identifier_msgs::msg::UUID;

constexpr ServiceTypes kCancelTypes = kTypesOf<CancelGoal>;

// Whether the goal was accepted: all that the reply of any action's send_goal says, beside a time.
Expected<bool> decision_in(std::span<const std::byte> reply, std::string_view type) {
  bool accepted = false;
  wire::builtin_interfaces::msg::Time stamp;
  wire::CdrReader read(reply);
  read("accepted", accepted);
  read("stamp", stamp);
  read.end();
  return read.failed() ? std::unexpected(read.error(type)) : Expected<bool>(accepted);
}

// What the reply of any action's get_result begins with.
Expected<std::int8_t> status_in(std::span<const std::byte> reply, std::string_view type) {
  std::int8_t status = GoalStatus::STATUS_UNKNOWN;
  wire::CdrReader read(reply);
  read("status", status);
  return read.failed() ? std::unexpected(read.error(type)) : Expected<std::int8_t>(status);
}

}  // namespace

GoalId new_goal_id() {
  std::random_device random;
  GoalId id;
  for (std::uint8_t& byte : id) byte = static_cast<std::uint8_t>(random());
  return id;
}

Expected<std::unique_ptr<GoalClient>> GoalClient::open(Node& node, std::string name, const ActionTypes& types) {
  std::unique_ptr<GoalClient> self(new GoalClient(node, std::move(name)));
  const std::string under = self->name_ + std::string(kActionPart);
  const auto open = [&](const char* service, const ServiceTypes& of, std::unique_ptr<ByteClient>& client) {
    auto opened = ByteClient::open(node, under + service, of);
    if (!opened) return Expected<void>(std::unexpected(opened.error()));
    client = *std::move(opened);
    return Expected<void>{};
  };
  if (auto opened = open("send_goal", types.send_goal, self->sends_); !opened) return std::unexpected(opened.error());
  if (auto opened = open("cancel_goal", kCancelTypes, self->cancels_); !opened) return std::unexpected(opened.error());
  if (auto opened = open("get_result", types.get_result, self->results_); !opened)
    return std::unexpected(opened.error());
  auto feedback = node.add_reader(under + "feedback", Use::kTopic, types.feedback, types.feedback_hash, kTopicQos);
  if (!feedback) return std::unexpected(feedback.error());
  self->feedback_ = *std::move(feedback);
  self->feedback_topic_ = node.wire_name(under + "feedback", Use::kTopic).value_or("");
  self->decision_type_ = types.send_goal.response;
  self->end_type_ = types.get_result.response;
  return self;
}

bool GoalClient::available() {
  const bool feeds_back = std::ranges::any_of(node_.graph().endpoints(), [this](const auto& each) {
    return each.second.writes && each.second.topic == feedback_topic_;
  });
  // Each is asked: they count from when they are first seen.
  const bool sends = sends_->available(), cancels = cancels_->available(), results = results_->available();
  return feeds_back && sends && cancels && results;
}

Expected<void> GoalClient::send(const GoalId& id, std::vector<std::byte> request,
                                std::optional<std::chrono::milliseconds> ends_within, Hears hears) {
  const auto server = results_->server();
  if (several()) return fail("several servers are there, and each would do it", name_, "stop all but one");
  if (!cancels_->present() || !server) return fail("no server is there", name_, "start it, on the same domain");
  auto called = sends_->call(std::move(request), kAnswersWithin,
                             [this, id, ends_within](const auto& reply) { decided(id, ends_within, reply); });
  if (!called) return std::unexpected(called.error());
  open_.emplace(id, Open{std::move(hears), *server, std::nullopt});
  return {};
}

void GoalClient::decided(const GoalId& id, std::optional<std::chrono::milliseconds> ends_within,
                         const Expected<std::span<const std::byte>>& reply) {
  const auto accepted = reply ? decision_in(*reply, decision_type_) : std::unexpected(reply.error());
  if (!accepted) {
    (void)cancel(id, {});  // it may accept it yet
    return finish(id, std::unexpected(accepted.error()));
  }
  if (!*accepted) return finish(id, fail(kGoalWasRejected, name_, "see what its server says"));
  const auto found = open_.find(id);
  if (found == open_.end()) return;  // forgotten meanwhile
  if (found->second.hears.accepted) found->second.hears.accepted();
  wait_for_end(id, ends_within);
}

void GoalClient::wait_for_end(const GoalId& id, std::optional<std::chrono::milliseconds> within) {
  const UUID whose{id};
  auto request = bytes_of_request(whose, name_);
  if (!request) return finish(id, std::unexpected(request.error()));
  const auto called = results_->call(
      *std::move(request), within,
      [this, id](const auto& reply) {
        const auto status = reply ? status_in(*reply, end_type_) : std::unexpected(reply.error());
        if (!reply) (void)cancel(id, {});
        if (!status) return finish(id, std::unexpected(status.error()));
        finish(id, Ended{*status, *reply});
      },
      server_of(id));
  if (!called) return finish(id, std::unexpected(called.error()));
  if (const auto found = open_.find(id); found != open_.end()) found->second.end = *called;
}

Expected<void> GoalClient::cancel(const GoalId& id, Cancelled cancelled) {
  CancelGoal::Request request;
  request.goal_info.goal_id.uuid = id;
  auto bytes = bytes_of_request(request, name_);
  if (!bytes) return std::unexpected(bytes.error());
  const auto called = cancels_->call(
      *std::move(bytes), kHearsWithin,
      [this, id, cancelled = std::move(cancelled)](const auto& reply) {
        if (!reply && open_.contains(id)) return void(unheard_.emplace_back(id, cancelled));
        if (!cancelled) return;
        if (!reply) return cancelled(std::unexpected(reply.error()));
        CancelGoal::Response response;
        if (const auto read = wire::decode(*reply, response); !read) return cancelled(std::unexpected(read.error()));
        cancelled(response.return_code);
      },
      server_of(id));
  return called ? Expected<void>{} : std::unexpected(called.error());
}

// Another may have come since.
std::optional<Guid> GoalClient::server_of(const GoalId& id) const {
  const auto found = open_.find(id);
  return found == open_.end() ? std::nullopt : std::optional(found->second.server);
}

void GoalClient::forget(const GoalId& id) {
  const auto found = open_.find(id);
  if (found == open_.end()) return;
  if (found->second.end) results_->forget(*found->second.end);
  open_.erase(found);
}

void GoalClient::spin(Clock::time_point now) {
  take_feedback();
  for (ByteClient* const client : {sends_.get(), cancels_.get(), results_.get()}) client->spin(now);
  for (auto& [id, cancelled] : std::exchange(unheard_, {})) {
    if (open_.contains(id)) (void)cancel(id, std::move(cancelled));
  }
  // Nothing more is heard of the goals of one that has gone, though another may have come.
  std::vector<GoalId> lost;
  for (const auto& [id, open] : open_) {
    if (!results_->reaches(open.server)) lost.push_back(id);
  }
  for (const GoalId& id : lost) finish(id, fail(kServerHasGone, name_, "start it again"));
}

Part::Clock::time_point GoalClient::due() const { return std::min({sends_->due(), cancels_->due(), results_->due()}); }

void GoalClient::take_feedback() {
  for (int left = kTakenAtOnce; left > 0 && feedback_->take(sample_); --left) {
    if (left == 1) node_.wake();  // there may be more
    UUID goal;
    wire::CdrReader read(sample_.bytes);
    read("goal_id", goal);
    if (read.failed()) {
      node_.unreadable(read.error("feedback of " + name_), sample_.id.writer);
      continue;
    }
    const auto found = open_.find(goal.uuid);
    if (found == open_.end() || !found->second.hears.feedback) continue;
    if (const auto taken = found->second.hears.feedback(sample_.bytes); !taken)
      node_.unreadable(taken.error(), sample_.id.writer);
  }
}

void GoalClient::finish(const GoalId& id, const Expected<Ended>& end) {
  const auto found = open_.find(id);
  if (found == open_.end()) return;
  const Hears hears = std::move(found->second.hears);
  forget(id);
  if (hears.ended) hears.ended(end);
}

}  // namespace pons::gate::ros
