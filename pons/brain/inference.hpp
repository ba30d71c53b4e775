// Who computes a policy's answers.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "pons/task/policy.hpp"

namespace pons::brain {

class Inference {
 public:
  virtual ~Inference() = default;
  // Never waits. Answers come in the order in which they were asked for.
  virtual void ask(std::shared_ptr<task::Policy> policy, task::Observation observation) = 0;
  // The next answer, if it is ready.
  [[nodiscard]] virtual std::optional<Chunk> take() = 0;
};

// In virtual time: at once, since how long it takes is modelled and not measured.
class PromptInference final : public Inference {
 public:
  void ask(std::shared_ptr<task::Policy> policy, task::Observation observation) override {
    answers_.push_back(policy->infer(observation));
  }
  [[nodiscard]] std::optional<Chunk> take() override {
    if (answers_.empty()) return std::nullopt;
    std::optional<Chunk> answer = std::move(answers_.front());
    answers_.pop_front();
    return answer;
  }

 private:
  std::deque<Chunk> answers_;
};

}  // namespace pons::brain
