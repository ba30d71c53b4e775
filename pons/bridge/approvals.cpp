// What a world leaves to people: a task waits, out of the queue, until one of them has allowed it. One that has begun
// asks nobody: an arm must not wait for a person. What could not be foreseen is refused then.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/open_task.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

std::string names(const Asked& asked) {
  std::set<std::string> names;
  for (const Leave& leave : asked) names.insert(fmt::format("{} ({})", leave.rule->approve, leave.rule->name));
  return fmt::format("{}", fmt::join(names, ", "));
}

Duration patience(const Asked& asked) {
  return std::ranges::min_element(asked, {}, [](const Leave& leave) { return leave.rule->within; })->rule->within;
}

Json listed(const Asked& asked) {
  Json list = Json::array();
  for (const Leave& leave : asked)
    list.push_back({{"rule", leave.rule->name}, {"tier", leave.rule->approve}, {"use", leave.use}});
  return list;
}

}  // namespace

void Bridge::ask(Open& open, Asked asked, Time now) {
  open.asked = std::move(asked);
  open.asked_since = now - held_for_;
  asking_.insert(open.task.id);
  unkept_ = true;
  tell(open, now, kAskedEvent, {{"wanted", listed(open.asked)}, {"within_s", to_s(patience(open.asked))}});
  park(open, now);
}

// Of one that another bridge has taken: also what was asked for then, though nobody can see now why.
Asked Bridge::still_to_ask(Asked judged, const Story& story) const {
  for (const Story::Wanted& wanted : story.wanted()) {
    const world::Rule* const rule = review_.rules().find(wanted.rule);
    const auto is_it = [&](const Leave& leave) { return leave.rule == rule && leave.use == wanted.use; };
    if (rule != nullptr && !rule->approve.empty() && std::ranges::none_of(judged, is_it))
      judged.push_back({rule, wanted.use});
  }
  std::erase_if(judged, [&](const Leave& leave) { return story.allowed().contains(Open::key(leave)); });
  return judged;
}

Expected<void> Bridge::approve(std::string_view id, std::string_view tier, std::string_view by, Time now) {
  const auto found = find_open(id);
  if (!found) return std::unexpected(found.error());
  Open& open = **found;
  if (open.asked.empty())
    return fail(fmt::format("task '{}' asks nobody", open.task.id), {}, "pons task show says how it stands");
  Asked allowed, left;
  for (Leave& leave : Asked(open.asked)) {
    const auto may = review_.rules().may_allow(tier, *leave.rule);
    if (!may) return std::unexpected(may.error());
    (*may ? allowed : left).push_back(std::move(leave));
  }
  if (allowed.empty())
    return fail(fmt::format("task '{}' asks {}, not {}", open.task.id, names(left), task::excerpt(tier)), {},
                "ask one of them");
  Json keys = Json::array();
  for (const Leave& leave : allowed) {
    keys.push_back(Open::key(leave));
    open.allowed.insert(Open::key(leave));
  }
  unkept_ = true;
  tell(open, now, kAllowedEvent, {{"by", by}, {"tier", tier}, {"uses", std::move(keys)}});
  open.asked = std::move(left);
  if (!open.asked.empty()) return {};
  asking_.erase(open.task.id);
  if (!open.paused) unpark(open, now);
  return {};
}

void Bridge::expire_asked(Time now) {
  if (held()) return;
  const auto is_late = [&](const std::string& id) {
    const Open& open = *open_.find(id)->second;
    return now - held_for_ >= open.asked_since + patience(open.asked);
  };
  std::vector<std::string> late;
  std::ranges::copy_if(asking_, std::back_inserter(late), is_late);
  for (std::string& id : late) {
    Open& open = *open_.find(id)->second;
    leave(open, task::Outcome::kFailed, fmt::format("nobody has allowed it in time: {}", names(open.asked)));
    leaving_.push_back(std::move(id));
  }
}

// Whether a skill may start now.
Expected<void> Bridge::permit(const std::string& id, const task::Step& use, Time now) {
  const Open& open = *open_.find(id)->second;
  auto asked = review_.judge_start(open.task, use, *robots_[open.robot].skills);
  if (!asked) return std::unexpected(asked.error());
  std::erase_if(*asked, [&](const Leave& leave) { return open.allowed.contains(Open::key(leave)); });
  if (asked->empty()) return review_.rules().count_use(use.skill, now);
  return fail(
      fmt::format("against the rules of this world ({}): it needs leave of {}, which nobody was asked for before "
                  "it began",
                  asked->front().rule->name, asked->front().rule->approve),
      {}, "submit it as a task of its own");
}

}  // namespace pons::bridge
