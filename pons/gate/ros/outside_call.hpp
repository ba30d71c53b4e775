// One use of a skill that others serve, between two threads: the bridge's, which wants it done, and the node's, which
// asks for it. Neither waits for the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/gate/ros/goal_client.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/outside_form.hpp"

namespace pons::gate::ros {

class OutsideCall {
 public:
  struct End {
    enum class How : std::uint8_t {
      kDone,
      kCanceled,
      kAborted,
      kRejected,    // it was not begun
      kUnsent,      // likewise
      kServerGone,  // what it was at, nobody knows
      kLost,        // likewise: no answer, or none that can be read
    };
    How how = How::kLost;
    OutsideForm::Reply reply = {};  // of kDone, kCanceled and kAborted
    std::string why = {};           // of the others
  };
  struct News {
    bool sent = false, accepted = false;
    bool several = false;                // servers are there, of which none is asked
    bool goes_on = false;                // the server will not cancel it
    std::optional<task::Json> feedback;  // the last that was not looked at
    std::optional<End> end;
  };

  // `sent`: to the server, as OutsideForm::request() made it with this id.
  OutsideCall(const GoalId& goal, std::vector<std::byte> sent) : id(goal), request(std::move(sent)) {}
  const GoalId id;
  const std::vector<std::byte> request;

  // ---- the bridge's thread ----

  [[nodiscard]] News look();
  // True: it was not sent, and will not be.
  [[nodiscard]] bool withdraw();
  void cancel();

  // ---- the node's thread ----

  // False: it was withdrawn. Else it counts as sent from here on.
  [[nodiscard]] bool begin();
  void find_several(bool servers);
  void accept();
  void goes_on();
  void tell(task::Json feedback);
  // The first end counts.
  void end(End end);
  [[nodiscard]] bool ended();
  [[nodiscard]] bool cancelled();
  // Once after cancel().
  [[nodiscard]] bool take_cancel();

 private:
  std::mutex mutex_;
  News news_;  // under mutex_, as are:
  bool withdrawn_ = false, cancelled_ = false, cancel_taken_ = false;
};

// On which calls of one skill come to the node's thread.
class OutsideLine {
 public:
  // Any thread. Without a node it stays where it is.
  void put(std::shared_ptr<OutsideCall> call);
  void wake();
  [[nodiscard]] std::vector<std::shared_ptr<OutsideCall>> take();
  // From `node` being there until it is null. The node's thread.
  void connect(const Node* node);

 private:
  std::mutex mutex_;
  std::vector<std::shared_ptr<OutsideCall>> calls_;  // under mutex_, as is:
  const Node* node_ = nullptr;
};

// What the node does for one such skill: waits for its server, asks it, and hears what comes of that. On the node's
// thread.
class OutsideServer : public Part {
 public:
  // Errors: those of Node::add_writer().
  [[nodiscard]] static Expected<std::unique_ptr<OutsideServer>> open(Node& node,
                                                                     std::shared_ptr<const OutsideForm> form,
                                                                     const std::shared_ptr<OutsideLine>& line);
  ~OutsideServer() override;
  OutsideServer(const OutsideServer&) = delete;
  OutsideServer& operator=(const OutsideServer&) = delete;

  void spin(Clock::time_point now) override;
  [[nodiscard]] Clock::time_point due() const override;

 protected:
  using Call = std::shared_ptr<OutsideCall>;
  OutsideServer(std::shared_ptr<const OutsideForm> form, std::shared_ptr<OutsideLine> line)
      : form_(std::move(form)), line_(std::move(line)) {}
  std::shared_ptr<const OutsideForm> form_;

 private:
  virtual Part& client() = 0;
  [[nodiscard]] virtual const Part& client() const = 0;
  [[nodiscard]] virtual bool available() = 0;
  [[nodiscard]] virtual bool several() const = 0;
  virtual Expected<void> send(const Call& call) = 0;
  virtual void cancel(const Call& call) = 0;
  // What comes of it is not waited for any more.
  virtual void forget(const Call& call) = 0;
  // Whether the server that was asked is still there.
  [[nodiscard]] virtual bool reaches(const Call& call) = 0;

  std::shared_ptr<OutsideLine> line_;
  // An answer is waited for as long as the skill does, whose time may stand; from when it is told to end, as long as
  // this says.
  struct Open {
    Call call;
    Clock::time_point until = Clock::time_point::max();
  };
  std::vector<Call> waiting_;
  std::vector<Open> open_;
};

}  // namespace pons::gate::ros
