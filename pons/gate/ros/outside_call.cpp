#include "pons/gate/ros/outside_call.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <map>

#include "pons/gate/ros/service.hpp"

namespace pons::gate::ros {
namespace {

using How = OutsideCall::End::How;

constexpr std::chrono::milliseconds kLooksForServer{50};
constexpr std::chrono::seconds kEndsWithin{60};  // once it is told to: longer than its skill waits then

OutsideCall::End unreadable(const Error& error) {
  return {How::kLost, {}, "its answer cannot be read: " + error.line()};
}

OutsideCall::End unknown_end(const Error& error) {
  if (error.what == kGoalWasRejected) return {How::kRejected, {}, error.what};
  if (error.what == kServerHasGone) return {How::kServerGone, {}, error.what};
  return {How::kLost, {}, error.line()};
}

class AnAction final : public OutsideServer {
 public:
  AnAction(std::shared_ptr<const OutsideForm> form, std::shared_ptr<OutsideLine> line,
           std::unique_ptr<GoalClient> goals)
      : OutsideServer(std::move(form), std::move(line)), goals_(std::move(goals)) {}

 private:
  Part& client() override { return *goals_; }
  [[nodiscard]] const Part& client() const override { return *goals_; }
  [[nodiscard]] bool available() override { return goals_->available(); }
  [[nodiscard]] bool several() const override { return goals_->several(); }
  [[nodiscard]] bool reaches(const Call&) override { return true; }  // its client says when it has gone

  Expected<void> send(const Call& call) override {
    return goals_->send(call->id, call->request, std::nullopt,
                        {.accepted =
                             [this, call] {
                               call->accept();
                               if (call->cancelled()) cancel(call);  // before, the server may have known no such goal
                             },
                         .feedback = [this, call](std::span<const std::byte> bytes) -> Expected<void> {
                           auto told = form_->feedback(bytes);
                           if (!told) return std::unexpected(told.error());
                           call->tell(*std::move(told));
                           return {};
                         },
                         .ended = [this, call](const auto& end) { call->end(meaning(end)); }});
  }
  void cancel(const Call& call) override {
    (void)goals_->cancel(call->id, [call](const Expected<std::int8_t>& code) {
      if (code && *code == CancelGoal::Response::ERROR_REJECTED) call->goes_on();
    });
  }
  void forget(const Call& call) override { goals_->forget(call->id); }
  [[nodiscard]] OutsideCall::End meaning(const Expected<GoalClient::Ended>& end) const {
    if (!end) return unknown_end(end.error());
    const auto how = [&]() -> std::optional<How> {
      switch (end->status) {
        case GoalStatus::STATUS_SUCCEEDED:
          return How::kDone;
        case GoalStatus::STATUS_CANCELED:
          return How::kCanceled;
        case GoalStatus::STATUS_ABORTED:
          return How::kAborted;
        default:
          return std::nullopt;
      }
    }();
    if (!how) return {How::kLost, {}, "its server knows nothing of the goal"};
    auto reply = form_->reply(end->reply);
    if (!reply) return unreadable(reply.error());
    return {*how, *std::move(reply), {}};
  }

  std::unique_ptr<GoalClient> goals_;
};

class AService final : public OutsideServer {
 public:
  AService(std::shared_ptr<const OutsideForm> form, std::shared_ptr<OutsideLine> line,
           std::unique_ptr<ByteClient> bytes)
      : OutsideServer(std::move(form), std::move(line)), bytes_(std::move(bytes)) {}

 private:
  Part& client() override { return *bytes_; }
  [[nodiscard]] const Part& client() const override { return *bytes_; }
  [[nodiscard]] bool available() override { return bytes_->available(); }
  [[nodiscard]] bool several() const override { return bytes_->several(); }
  [[nodiscard]] bool reaches(const Call& call) override {
    const auto found = asked_.find(call->id);
    return found == asked_.end() || bytes_->reaches(found->second.server);
  }
  Expected<void> send(const Call& call) override {
    const auto server = bytes_->server();
    const auto number = bytes_->call(call->request, std::nullopt, [this, call](const auto& answer) {
      asked_.erase(call->id);
      if (!answer) return call->end({How::kLost, {}, answer.error().line()});
      auto reply = form_->reply(*answer);
      if (!reply) return call->end(unreadable(reply.error()));
      call->end({How::kDone, *std::move(reply), {}});
    });
    if (!number) return std::unexpected(number.error());
    if (server) asked_[call->id] = {*server, *number};
    return {};
  }
  void cancel(const Call&) override {}  // ROS 2 has no word for it
  void forget(const Call& call) override {
    const auto found = asked_.find(call->id);
    if (found == asked_.end()) return;
    bytes_->forget(found->second.number);
    asked_.erase(found);
  }

  struct Asked {
    Guid server{};
    std::int64_t number = 0;  // of the call
  };
  std::unique_ptr<ByteClient> bytes_;
  std::map<GoalId, Asked> asked_;
};

}  // namespace

// ---- a call ----

OutsideCall::News OutsideCall::look() {
  const std::scoped_lock lock(mutex_);
  News news = news_;
  news_.feedback.reset();
  return news;
}

bool OutsideCall::withdraw() {
  const std::scoped_lock lock(mutex_);
  withdrawn_ = !news_.sent;
  return withdrawn_;
}

void OutsideCall::cancel() {
  const std::scoped_lock lock(mutex_);
  cancelled_ = true;
}

bool OutsideCall::begin() {
  const std::scoped_lock lock(mutex_);
  news_.sent = !withdrawn_;
  return news_.sent;
}

void OutsideCall::find_several(bool servers) {
  const std::scoped_lock lock(mutex_);
  news_.several = servers;
}

void OutsideCall::accept() {
  const std::scoped_lock lock(mutex_);
  news_.accepted = true;
}

void OutsideCall::goes_on() {
  const std::scoped_lock lock(mutex_);
  news_.goes_on = true;
}

void OutsideCall::tell(task::Json feedback) {
  const std::scoped_lock lock(mutex_);
  news_.feedback = std::move(feedback);
}

void OutsideCall::end(End end) {
  const std::scoped_lock lock(mutex_);
  if (!news_.end) news_.end = std::move(end);
}

bool OutsideCall::ended() {
  const std::scoped_lock lock(mutex_);
  return news_.end.has_value();
}

bool OutsideCall::cancelled() {
  const std::scoped_lock lock(mutex_);
  return cancelled_;
}

bool OutsideCall::take_cancel() {
  const std::scoped_lock lock(mutex_);
  return cancelled_ && !std::exchange(cancel_taken_, true);
}

// ---- between the threads ----

void OutsideLine::put(std::shared_ptr<OutsideCall> call) {
  const std::scoped_lock lock(mutex_);
  calls_.push_back(std::move(call));
  if (node_ != nullptr) node_->wake();
}

void OutsideLine::wake() {
  const std::scoped_lock lock(mutex_);
  if (node_ != nullptr) node_->wake();
}

std::vector<std::shared_ptr<OutsideCall>> OutsideLine::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(calls_, {});
}

void OutsideLine::connect(const Node* node) {
  const std::scoped_lock lock(mutex_);
  node_ = node;
}

// ---- at the node ----

Expected<std::unique_ptr<OutsideServer>> OutsideServer::open(Node& node, std::shared_ptr<const OutsideForm> form,
                                                             const std::shared_ptr<OutsideLine>& line) {
  const std::string& name = form->skill().server.text;
  std::unique_ptr<OutsideServer> server;
  if (form->acts()) {
    auto goals = GoalClient::open(node, name, form->action_types());
    if (!goals) return std::unexpected(goals.error());
    server = std::make_unique<AnAction>(std::move(form), line, *std::move(goals));
  } else {
    auto bytes = ByteClient::open(node, name, form->service_types());
    if (!bytes) return std::unexpected(bytes.error());
    server = std::make_unique<AService>(std::move(form), line, *std::move(bytes));
  }
  line->connect(&node);
  return server;
}

OutsideServer::~OutsideServer() { line_->connect(nullptr); }

void OutsideServer::spin(Clock::time_point now) {
  std::ranges::move(line_->take(), std::back_inserter(waiting_));
  client().spin(now);
  // Asked each time: it counts from when the server was first seen.
  if (available()) {
    for (const Call& call : std::exchange(waiting_, {})) {
      if (!call->begin()) continue;
      if (auto sent = send(call); !sent) call->end({How::kUnsent, {}, sent.error().line()});
      open_.push_back({call});
    }
  }
  for (const Call& call : waiting_) call->find_several(several());
  for (auto& [call, until] : open_) {
    if (call->take_cancel()) {
      cancel(call);
      until = now + kEndsWithin;
    }
    if (!reaches(call)) {
      call->end({How::kServerGone, {}, kServerHasGone});
      forget(call);
    } else if (now >= until) {
      call->end({How::kLost, {}, "no answer in time"});
      forget(call);
    }
  }
  std::erase_if(open_, [](const Open& open) { return open.call->ended(); });
}

Part::Clock::time_point OutsideServer::due() const {
  auto due = client().due();
  for (const Open& open : open_) due = std::min(due, open.until);
  return waiting_.empty() ? due : std::min(due, Clock::now() + kLooksForServer);
}

}  // namespace pons::gate::ros
