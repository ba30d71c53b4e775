#include "pons/bridge/review/contradictions.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

// The values of those arguments; none where one is missing.
task::Json values(const std::vector<std::string>& arguments, const task::Json& given) {
  auto list = task::Json::array();
  for (const std::string& argument : arguments) {
    const auto found = given.find(argument);
    if (found == given.end()) return {};
    // 1 and 1.0 are the same.
    list.push_back(found->is_number() ? task::Json(found->get<double>()) : *found);
  }
  return list;
}

}  // namespace

std::vector<Contradictions::Said> Contradictions::said(const task::Step& use) const {
  std::vector<Said> all;
  for (const world::Contradiction& kind : kinds_) {
    if (std::ranges::find(kind.skills, use.skill) == kind.skills.end()) continue;
    const task::Json about = values(kind.same, use.arguments);
    if (about.is_null()) continue;
    const task::Json says = values(kind.differ, use.arguments);
    all.push_back({&kind, kind.name + about.dump(), says.dump()});
  }
  return all;
}

std::optional<Contradictions::Other> Contradictions::against(const Said& said, const task::Task& task) const {
  const auto claims = claims_.find(said.about);
  if (claims == claims_.end()) return {};
  const bool one_at_a_time = said.kind->differ.empty();
  const auto mine = [&](const std::string& id) { return id == task.id && task.tree; };
  // Two that disagree were never let in, but for those of one tree: few are looked at.
  for (const auto& [says, tasks] : claims->second) {
    if (!one_at_a_time && says == said.says) continue;
    const auto other = std::ranges::find_if_not(tasks, mine);
    if (other != tasks.end()) return Other{*other, says};
  }
  return {};
}

Expected<void> Contradictions::claim(const task::Task& task, std::span<const UseOf> uses) {
  std::vector<Claim> made;
  for (const UseOf& use : uses) {
    for (Said& said : said(use.use)) {
      if (const auto other = against(said, task)) {
        for (const Claim& claim : made) drop(task.id, claim);
        return fail(fmt::format("against the rules of this world ({}): {} {} contradicts {} of task '{}'",
                                said.kind->name, use.use.skill, task::excerpt(use.use.arguments.dump(), 120),
                                task::excerpt(other->says, 120), other->task),
                    use.where,
                    other->task == task.id ? "leave one of them out" : "leave it out, or cancel the other task");
      }
      Claim claim{std::move(said.about), std::move(said.says)};
      std::set<Claim>& all = claimed_by_[task.id];
      if (all.size() >= kMost && !all.contains(claim)) {
        for (const Claim& each : made) drop(task.id, each);
        return fail(fmt::format("the task has said {} different things of what others may contradict ({})", kMost,
                                said.kind->name),
                    use.where, "divide it");
      }
      if (!all.insert(claim).second) continue;
      claims_[claim.about][claim.says].insert(task.id);
      made.push_back(std::move(claim));
    }
  }
  return {};
}

void Contradictions::drop(const std::string& task, const Claim& claim) {
  const auto claims = claims_.find(claim.about);
  const auto tasks = claims->second.find(claim.says);
  tasks->second.erase(task);
  if (tasks->second.empty()) claims->second.erase(tasks);
  if (claims->second.empty()) claims_.erase(claims);
  const auto claimed = claimed_by_.find(task);
  claimed->second.erase(claim);
  if (claimed->second.empty()) claimed_by_.erase(claimed);
}

void Contradictions::release(std::string_view task) {
  const auto claimed = claimed_by_.find(task);
  if (claimed == claimed_by_.end()) return;
  const std::string id = claimed->first;
  for (const Claim& claim : std::set<Claim>(claimed->second)) drop(id, claim);
}

}  // namespace pons::bridge
