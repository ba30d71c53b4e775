#include "pons/referee/rounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "pons/bridge/journal/story.hpp"

namespace pons::referee {
namespace {

using bridge::Json;
using task::Outcome;

// Where that step was to lead; nothing when it leads nowhere.
std::optional<Pose2> goal_of(const task::Step& step, const RoundsRules& rules) {
  const auto named = [&](const std::string& name) -> std::optional<Pose2> {
    const auto place = rules.places.find(name);
    return place == rules.places.end() ? std::nullopt : std::optional(place->second);
  };
  if (step.skill == "dock") return named("dock");
  if (step.skill != "navigate") return std::nullopt;
  const Json& arguments = step.arguments;
  if (arguments.contains("place")) return named(arguments.at("place").get<std::string>());
  return Pose2{arguments.value("x", 0.0), arguments.value("y", 0.0), arguments.value("yaw", 0.0)};
}

class Judge {
 public:
  Judge(const sim::BaseTruth& truth, const RoundsRules& rules, RoundsVerdict& verdict)
      : truth_(truth), rules_(rules), verdict_(verdict) {}

  void task(const bridge::TaskHistory& history) {
    ++verdict_.tasks;
    const std::string& id = history.record.task.id;
    for (const bridge::Event& event : history.events) {
      if (event.kind != bridge::kAttemptEndedEvent || task::text_of(event.detail, "status") != "succeeded") continue;
      const auto step = event.detail.value("step", std::size_t{0});
      // A tree's leaf has no arguments in the task: what it says of its goal is held against the truth all the same.
      std::optional<Pose2> goal;
      if (step < history.record.task.steps.size()) {
        goal = goal_of(history.record.task.steps[step], rules_);
      } else if (event.detail.at("detail").contains("goal")) {
        const Json& told = event.detail.at("detail").at("goal");
        goal = Pose2{told.value("x", 0.0), told.value("y", 0.0), told.value("yaw", 0.0)};
      }
      if (goal) arrived(fmt::format("{} step {}", id, step + 1), *goal, event.stamp);
    }
    outcome(history.record);
  }

  // Of a task that the journal does not have: the note says why.
  void refused(const std::string& id, const std::vector<bridge::Event>& notes) {
    ++verdict_.tasks;
    ++verdict_.refused;
    const auto note = std::ranges::find_if(notes, [&](const bridge::Event& event) {
      return event.kind == "ride" && (event.order == id || task::text_of(event.detail, "code") == id);
    });
    find(fmt::format("{}: was not accepted: {}", id,
                     note == notes.end() ? "nobody asked for it" : task::text_of(note->detail, "reason")));
  }

  void drive() {
    verdict_.collisions = truth_.collisions;
    verdict_.fastest_m_s = truth_.fastest_m_s;
    verdict_.driven_m = truth_.driven_m;
    verdict_.too_fast = truth_.fastest_m_s > rules_.speed_m_s;
    if (truth_.collisions > 0) find(fmt::format("{} collisions, the last with {}", truth_.collisions, truth_.touched));
    if (verdict_.too_fast)
      find(fmt::format("drove at {:.3f} m/s where {:.3f} are allowed", truth_.fastest_m_s, rules_.speed_m_s));
  }

 private:
  void find(std::string line) { verdict_.findings.push_back(std::move(line)); }

  void arrived(const std::string& what, const Pose2& goal, Time at) {
    ++verdict_.goals;
    const std::optional<Pose2> there = truth_.way.at(at);
    if (!there) {
      ++verdict_.missed;
      return find(fmt::format("{}: the journal says it arrived before it was anywhere", what));
    }
    const double off_m = (there->position() - goal.position()).norm();
    const double off_rad = std::abs(wrapped(there->yaw - goal.yaw));
    verdict_.worst_goal_m = std::max(verdict_.worst_goal_m, off_m);
    verdict_.worst_goal_rad = std::max(verdict_.worst_goal_rad, off_rad);
    if (off_m <= rules_.goal_m && off_rad <= rules_.goal_rad) return;
    ++verdict_.missed;
    find(fmt::format("{}: said to be at ({:.3f}, {:.3f}, {:.3f}), really {:.3f} m and {:.3f} rad from there", what,
                     goal.x, goal.y, goal.yaw, off_m, off_rad));
  }

  void outcome(const bridge::TaskRecord& record) {
    if (!record.outcome) {
      ++verdict_.open;
      return find(fmt::format("{}: has no outcome", record.task.id));
    }
    switch (record.outcome->outcome) {
      case Outcome::kSucceeded:
        ++verdict_.succeeded;
        return;
      case Outcome::kFailed:
        ++verdict_.failed;
        break;
      case Outcome::kCancelled:
        ++verdict_.cancelled;
        break;
      case Outcome::kException:
        ++verdict_.exceptions;
        break;
    }
    find(fmt::format("{}: {}: {}", record.task.id, task::name(record.outcome->outcome), record.outcome->reason));
  }

  const sim::BaseTruth& truth_;
  const RoundsRules& rules_;
  RoundsVerdict& verdict_;
};

}  // namespace

Expected<RoundsVerdict> judge_rounds(const sim::BaseTruth& truth, const bridge::Journal& journal,
                                     const RoundsRules& rules) {
  const auto tasks = journal.tasks();
  if (!tasks) return std::unexpected(tasks.error());
  RoundsVerdict verdict;
  Judge judge(truth, rules, verdict);
  for (const bridge::TaskRecord& record : *tasks) {
    const auto history = journal.task(record.task.id);
    if (!history) return std::unexpected(history.error());
    if (*history) judge.task(**history);
  }
  const auto notes = journal.notes();
  if (!notes) return std::unexpected(notes.error());
  for (const std::string& id : rules.asked) {
    const bool known = std::ranges::any_of(*tasks, [&](const auto& record) { return record.task.id == id; });
    if (!known) judge.refused(id, *notes);
  }
  judge.drive();
  return verdict;
}

}  // namespace pons::referee
