#include "pons/runner/health.hpp"

#include <fmt/format.h>

#include <utility>

namespace pons::runner {
namespace {

constexpr std::size_t kMostUntold = 64;  // of lines that nobody takes

}  // namespace

std::string_view name(Condition condition) {
  switch (condition) {
    case Condition::kGood:
      return "good";
    case Condition::kPoor:
      return "poor";
    case Condition::kBad:
      return "bad";
  }
  return "";
}

void Health::begin_with(const std::map<std::string, std::int64_t, std::less<>>& alerts, Time now) {
  for (const auto& [part, count] : alerts) {
    parts_[part] = PartHealth{.since = now, .alerts = count};
    alerts_ += count;
  }
}

void Health::tell(std::string_view part, Condition measured, std::string_view why, Time now) {
  auto entry = parts_.find(part);
  if (entry == parts_.end()) entry = parts_.emplace(std::string(part), PartHealth{.since = now}).first;
  PartHealth& known = entry->second;
  if (measured >= known.condition) {
    if (const auto better = better_.find(part); better != better_.end()) better_.erase(better);
    if (measured > known.condition) change(part, known, measured, why, now);
    return;
  }
  const auto [better, is_new] = better_.try_emplace(entry->first, Better{now, measured, std::string(why)});
  if (!is_new && measured > better->second.at_worst)
    better->second = {better->second.since, measured, std::string(why)};
  if (now - better->second.since < kBetterFor) return;
  const Better lasted = std::move(better->second);
  better_.erase(better);
  change(part, known, lasted.at_worst, lasted.why, now);
}

void Health::change(std::string_view part, PartHealth& known, Condition condition, std::string_view why, Time now) {
  const bool worse = condition > known.condition;
  known.condition = condition;
  known.why = condition == Condition::kGood ? std::string() : std::string(why);
  known.since = now;
  if (worse) {
    ++known.alerts;
    ++alerts_;
    if (untold_.size() < kMostUntold)
      untold_.push_back(fmt::format("{} is {} at {:.3f} s: {}", part, name(condition), now.s(), known.why));
  }
  if (told_) told_(part, known, now);
}

bool Health::is_bad(std::string_view part) const {
  const auto known = parts_.find(part);
  return known != parts_.end() && known->second.condition == Condition::kBad;
}

std::vector<std::string> Health::take_alerts() { return std::exchange(untold_, {}); }

task::Json Health::describe() const {
  task::Json parts = task::Json::array();
  for (const auto& [part, health] : parts_) {
    parts.push_back({{"part", part},
                     {"condition", name(health.condition)},
                     {"why", health.why},
                     {"since_s", health.since.s()},
                     {"alerts", health.alerts}});
  }
  return {{"alerts", alerts_}, {"parts", std::move(parts)}};
}

}  // namespace pons::runner
