#include "pons/task/skill.hpp"

#include <cassert>

namespace pons::task {

std::string_view name(Status status) {
  switch (status) {
    case Status::kRunning:
      return "running";
    case Status::kPaused:
      return "paused";
    case Status::kSucceeded:
      return "succeeded";
    case Status::kRetry:
      return "retry";
    case Status::kFailed:
      return "failed";
    case Status::kException:
      return "exception";
  }
  return "unknown";
}

std::string_view name(StopResult result) {
  switch (result) {
    case StopResult::kConfirmed:
      return "CONFIRMED";
    case StopResult::kUncertain:
      return "UNCERTAIN";
    case StopResult::kFailed:
      return "FAILED";
  }
  return "unknown";
}

void SkillRegistry::add(SkillType type) {
  assert(!type.name.empty() && type.start && type.attempts >= 1 && type.timeout > Duration{0});
  std::string name = type.name;
  [[maybe_unused]] const bool added = types_.emplace(std::move(name), std::move(type)).second;
  assert(added);
}

const SkillType* SkillRegistry::find(std::string_view name) const {
  const auto found = types_.find(name);
  return found == types_.end() ? nullptr : &found->second;
}

}  // namespace pons::task
