// What is asked on a gate's own thread and answered by whoever polls (Visitors), and the answers' way back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/local_socket.hpp"

namespace pons::gate {

// What is urgent has room when nothing else has. Ask for so little of it that this is enough.
enum class Urgency : std::uint8_t { kAny, kUrgent };

class Questions {
 public:
  static constexpr std::size_t kUrgentMost = 16;  // besides
  using Answered = std::function<void(const Json&)>;

  // At most `most` wait to be polled; more are refused at once, in the name of `where`. `wake` is called, by any
  // thread, when answers have come that take_answers() should hand out.
  Questions(std::string where, std::size_t most, std::function<void()> wake);
  // Answers that come later are nobody's; neither is `wake` called any more.
  ~Questions() { close(); }
  void close();
  Questions(const Questions&) = delete;
  Questions& operator=(const Questions&) = delete;

  // ---- on the gate's thread ----

  // `answered` is called on that thread, once, unless whoever polls goes without answering.
  void ask(std::string request, Answered answered, Urgency urgency = Urgency::kAny) {
    put({std::move(request), std::nullopt, 0}, std::move(answered), urgency);
  }
  // For what came and cannot be asked, so that whoever answers can write it down: its text, and why. Answered likewise.
  void refuse(std::string text, Error why, Answered answered) {
    put({std::move(text), std::move(why), 0}, std::move(answered), Urgency::kAny);
  }
  void take_answers();

  // ---- on the thread of whoever answers ----

  // What is urgent, and a Portion of the others; answers may come from any thread.
  [[nodiscard]] std::vector<Request> poll();

 private:
  struct Asked {
    std::string text;
    std::optional<Error> refused;
    std::uint64_t number = 0;
  };
  // What the two sides share; it may outlive this.
  struct Answers {
    std::mutex mutex;
    std::vector<std::pair<std::uint64_t, Json>> came;  // under mutex, as is:
    std::function<void()> wake;                        // empty once nobody waits
  };
  void put(Asked asked, Answered answered, Urgency urgency);

  const std::string where_;
  const std::size_t most_;
  std::map<std::uint64_t, Answered> open_;  // of the gate's thread, as is:
  std::uint64_t numbers_ = 0;
  std::shared_ptr<Answers> answers_ = std::make_shared<Answers>();
  std::mutex mutex_;
  std::deque<Asked> asked_, urgent_;  // under mutex_
};

}  // namespace pons::gate
