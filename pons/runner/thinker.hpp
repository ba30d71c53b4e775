// A thread that runs policies in real time, so that the bridge never waits for one.
#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "pons/brain/inference.hpp"

namespace pons::runner {

class Thinker final : public brain::Inference {
 public:
  Thinker();
  ~Thinker() override;
  Thinker(const Thinker&) = delete;
  Thinker& operator=(const Thinker&) = delete;

  // On the bridge's thread. The lock they take is never held while a policy thinks.
  void ask(std::shared_ptr<task::Policy> policy, task::Observation observation) override;
  [[nodiscard]] std::optional<Chunk> take() override;

 private:
  void think(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::pair<std::shared_ptr<task::Policy>, task::Observation>> questions_;
  std::deque<Chunk> answers_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace pons::runner
