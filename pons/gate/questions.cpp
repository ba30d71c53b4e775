#include "pons/gate/questions.hpp"

#include <fmt/format.h>

#include <utility>

#include "pons/gate/request.hpp"

namespace pons::gate {

Questions::Questions(std::string where, std::size_t most, std::function<void()> wake)
    : where_(std::move(where)), most_(most) {
  answers_->wake = std::move(wake);
}

void Questions::close() {
  const std::scoped_lock lock(answers_->mutex);
  answers_->wake = nullptr;
}

void Questions::put(Asked asked, Answered answered, Urgency urgency) {
  {
    const std::scoped_lock lock(mutex_);
    const bool urgent = urgency == Urgency::kUrgent;
    if (asked_.size() + urgent_.size() < most_ + (urgent ? kUrgentMost : 0)) {
      asked.number = ++numbers_;
      (urgent ? urgent_ : asked_).push_back(std::move(asked));
      open_.emplace(numbers_, std::move(answered));
      return;
    }
  }
  answered(refusal({fmt::format("{} requests wait already", most_), where_, "ask again later"}));
}

std::vector<Request> Questions::poll() {
  std::deque<Asked> asked;
  {
    const std::scoped_lock lock(mutex_);
    asked.swap(urgent_);
    for (Portion portion; !asked_.empty() && portion.takes(asked_.front().text.size()); asked_.pop_front())
      asked.push_back(std::move(asked_.front()));
  }
  std::vector<Request> requests;
  for (Asked& each : asked) {
    requests.push_back({std::move(each.text),
                        [answers = answers_, number = each.number](const Json& answer) {
                          const std::scoped_lock lock(answers->mutex);
                          if (!answers->wake) return;
                          answers->came.emplace_back(number, answer);
                          answers->wake();
                        },
                        std::move(each.refused)});
  }
  return requests;
}

void Questions::take_answers() {
  decltype(answers_->came) came;
  {
    const std::scoped_lock lock(answers_->mutex);
    came.swap(answers_->came);
  }
  for (const auto& [number, answer] : came) {
    if (const auto open = open_.extract(number)) open.mapped()(answer);
  }
}

}  // namespace pons::gate
