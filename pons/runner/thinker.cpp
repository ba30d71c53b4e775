#include "pons/runner/thinker.hpp"

namespace pons::runner {

Thinker::Thinker() : thread_([this](const std::stop_token& stop) { think(stop); }) {}

Thinker::~Thinker() = default;

void Thinker::ask(std::shared_ptr<task::Policy> policy, task::Observation observation) {
  {
    const std::lock_guard lock(mutex_);
    questions_.emplace_back(std::move(policy), std::move(observation));
  }
  changed_.notify_all();
}

std::optional<Chunk> Thinker::take() {
  const std::lock_guard lock(mutex_);
  if (answers_.empty()) return std::nullopt;
  std::optional<Chunk> answer = std::move(answers_.front());
  answers_.pop_front();
  return answer;
}

void Thinker::think(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return !questions_.empty(); })) {
    const auto [policy, observation] = std::move(questions_.front());
    questions_.pop_front();
    lock.unlock();
    Chunk answer = policy->infer(observation);
    lock.lock();
    answers_.push_back(std::move(answer));
  }
}

}  // namespace pons::runner
