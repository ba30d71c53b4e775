#include "pons/brain/errands.hpp"

#include <algorithm>
#include <utility>

#include "pons/task/json_value.hpp"

namespace pons::brain {

Errands::Errands(std::vector<Errand> errands) : errands_(std::move(errands)) {
  std::ranges::stable_sort(errands_, {}, &Errand::at);
}

Decisions Errands::observe(const std::vector<ObjectBelief>&, Time now, const std::set<std::string>&) {
  Decisions decisions;
  for (; next_ < errands_.size() && errands_[next_].at <= now; ++next_) {
    asked_.insert(task::text_of(errands_[next_].task, "id"));
    decisions.tasks.push_back(errands_[next_].task);
  }
  return decisions;
}

bool Errands::heard(std::string_view id, task::Outcome) { return asked_.contains(id); }

// Asking once more is harmless, but would be in vain.
void Errands::recall(const task::Task& task, std::optional<task::Outcome>) {
  std::erase_if(errands_, [&](const Errand& errand) { return task::text_of(errand.task, "id") == task.id; });
}

}  // namespace pons::brain
