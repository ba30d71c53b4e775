// Which robot a task runs on, and what becomes of tasks when one stops.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/open_task.hpp"

namespace pons::bridge {
namespace {

void add(std::vector<std::string>& resources, const task::SkillType& type, const Json& arguments) {
  resources.insert(resources.end(), type.resources.begin(), type.resources.end());
  if (!type.holds) return;
  std::ranges::move(type.holds(arguments), std::back_inserter(resources));
}

}  // namespace

void Bridge::add_robot(const task::SkillRegistry& skills) {
  robots_.push_back({world_.arms()[robots_.size()].arm, &skills});
  review_.add_robot(skills);
}

bool Bridge::held() const {
  return std::ranges::all_of(robots_, [](const Robot& robot) { return robot.hold != Hold::kOff; });
}

std::set<std::string> Bridge::set_aside() const {
  std::set<std::string> ids = parked_;
  for (const auto& [id, open] : running_) {
    if (robots_[open->robot].hold == Hold::kGone) ids.insert(id);
  }
  if (std::ranges::none_of(robots_, [](const Robot& robot) { return robot.hold == Hold::kGone; })) return ids;
  const std::vector<std::string> kept = kept_by_gone();
  for (const auto& [id, open] : open_) {
    if (open->stage != Open::Stage::kWaits) continue;
    const bool waits = std::ranges::all_of(open->robots, [&](std::size_t robot) {
      return robots_[robot].hold == Hold::kGone || needs_any(*open, robot, kept);
    });
    if (waits) ids.insert(id);
  }
  return ids;
}

std::vector<std::string> Bridge::kept_by_gone() const {
  std::vector<std::string> kept;
  for (const auto& [id, open] : running_) {
    if (robots_[open->robot].hold == Hold::kGone)
      std::ranges::move(resources_for(open->task, open->program.get(), open->robot), std::back_inserter(kept));
  }
  return kept;
}

bool Bridge::needs_any(const Open& open, std::size_t robot, const std::vector<std::string>& resources) const {
  if (resources.empty()) return false;
  const auto is_one = [&](const std::string& needed) {
    return std::ranges::find(resources, needed) != resources.end();
  };
  if (robot == open.robot) return std::ranges::any_of(open.resources, is_one);
  return std::ranges::any_of(resources_for(open.task, open.program.get(), robot), is_one);
}

std::vector<std::string> Bridge::resources_for(const task::Task& task, const tree::Program* program,
                                               std::size_t robot) const {
  std::vector<std::string> resources;
  if (program != nullptr) {
    resources = program->resources;
    for (const tree::SkillUse& use : program->uses)
      add(resources, *use.type, use.bound.empty() ? use.arguments : Json());
  }
  for (const task::Step& step : task.steps) add(resources, *robots_[robot].skills->find(step.skill), step.arguments);
  return resources;
}

std::size_t Bridge::robot_named(std::string_view name) const {
  const auto robot = std::ranges::find(robots_, name, &Robot::name);
  return robot == robots_.end() ? 0 : static_cast<std::size_t>(robot - robots_.begin());
}

// Of one that begins, or that an earlier bridge has begun: what it has begun with hangs there, or lies before that one.
void Bridge::keep_to(Open& open, std::size_t robot) const {
  if (open.robots.size() == 1) return;
  if (!may_run(open, robot)) return;  // the world has changed
  open.robots = {robot};
  open.robot = robot;
  open.resources = resources_for(open.task, open.program.get(), robot);
}

bool Bridge::may_run(const Open& open, std::size_t robot) {
  return std::ranges::find(open.robots, robot) != open.robots.end();
}

// One of them the review has seen to be able.
std::vector<std::size_t> Bridge::robots_for(const task::Task& task, const tree::Program* program) const {
  if (robots_.size() == 1 || task.tree || resources_for(task, program, 0).empty()) return {0};
  std::vector<std::size_t> robots;
  for (std::size_t robot = 0; robot < robots_.size(); ++robot) {
    const bool can = std::ranges::all_of(task.steps, [&](const task::Step& step) {
      const task::SkillType* const type = robots_[robot].skills->find(step.skill);
      return type != nullptr && (!type->feasible || type->feasible(step.arguments, task::Moment::kAdmission));
    });
    if (can) robots.push_back(robot);
  }
  if (robots.empty()) robots.push_back(0);  // by now no robot can: its start says so
  return robots;
}

// Of all steps the worst: what has gone is gone, what cannot be taken yet is waited for.
task::Chance Bridge::chance(const Open& open, std::size_t robot) const {
  auto worst = task::Chance::kNow;
  for (const task::Step& step : open.task.steps) {
    const task::SkillType& type = *robots_[robot].skills->find(step.skill);
    const task::Chance chance = type.chance ? type.chance(step.arguments) : task::Chance::kNow;
    if (chance == task::Chance::kGone) return chance;
    if (chance == task::Chance::kNotYet) worst = chance;
  }
  return worst;
}

// What no robot that works can take any more is given to any: its skill says what has become of it. What waits for
// something that a robot keeps which is gone, keeps nothing else from others meanwhile.
Arbiter::Fits Bridge::fits() const {
  return [this, kept = kept_by_gone()](std::string_view id, std::size_t way) {
    const Open& open = *open_.find(id)->second;
    const std::size_t robot = open.robots[way];
    if (is_held(robot) || needs_any(open, robot, kept)) return false;
    if (open.begun) return true;
    const task::Chance own = chance(open, robot);
    if (own != task::Chance::kGone) return own == task::Chance::kNow;
    return std::ranges::all_of(open.robots, [&](std::size_t other) {
      return robots_[other].hold == Hold::kGone || chance(open, other) == task::Chance::kGone;
    });
  };
}

// ---- emergency stop ----

void Bridge::emergency_stop(Time now, std::string_view cause, std::size_t robot) {
  if (robots_[robot].emergency) return;
  robots_[robot].emergency = cause;
  if (on_emergency_stop_ == world::OnEmergencyStop::kCancel) {
    end_those([&](const Open& open) { return may_run(open, robot) && is_stopped(open); }, now,
              fmt::format("stopped: {}", cause));
    return;
  }
  held_to_ = "";
  tell_held(now);
}

void Bridge::released(Time now, std::size_t robot) {
  if (!std::exchange(robots_[robot].emergency, std::nullopt)) return;
  held_to_ = "";
  tell_held(now);
}

// Whether all that may run it have had an emergency stop.
bool Bridge::is_stopped(const Open& open) const {
  return std::ranges::all_of(open.robots, [&](std::size_t robot) { return robots_[robot].emergency.has_value(); });
}

// Of each task once that this has changed; so many at a time.
void Bridge::tell_held(Time now) {
  if (!held_to_) return;
  std::size_t told = 0;
  for (auto next = open_.lower_bound(*held_to_); next != open_.end(); ++next) {
    Open& open = *next->second;
    if (is_to_be_held(open) == open.held || open.stage == Open::Stage::kLeaves) continue;
    if (++told > kWrittenATick) {
      held_to_ = next->first;
      return;
    }
    tell_held(open, now);
  }
  held_to_.reset();
}

bool Bridge::is_to_be_held(const Open& open) const {
  return on_emergency_stop_ == world::OnEmergencyStop::kHold && is_stopped(open);
}

void Bridge::tell_held(Open& open, Time now) {
  if (is_to_be_held(open) == open.held) return;
  open.held = !open.held;
  unkept_ = true;
  open.held ? tell(open, now, kHeldEvent, {{"cause", *robots_[open.robot].emergency}})
            : tell(open, now, kReleasedEvent);
}

}  // namespace pons::bridge
