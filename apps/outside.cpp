#include "apps/outside.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ranges>
#include <string>

namespace pons::apps {

Expected<void> check_outside(const world::World& world, const RosOptions& ros, runner::Pace pace) {
  if (world.outside_skills.empty()) return {};
  const world::OutsideSkill& first = world.outside_skills.front();
  const auto refused = [&](std::string_view why, std::string_view option) {
    return fail(fmt::format("the skill '{}' is served by another node{}", first.name, why), first.where,
                fmt::format("add {}", option));
  };
  if (!ros.on) return refused(", and this run is none", "--ros");
  if (pace == runner::Pace::kLockstep) return refused(", which lives by the clock", "--realtime");
  return {};
}

std::vector<std::filesystem::path> interface_folders(const world::World& world) {
  std::vector<std::filesystem::path> folders = world.interfaces;
  const char* const prefixes = std::getenv("AMENT_PREFIX_PATH");
  for (const auto prefix : std::views::split(std::string_view(prefixes == nullptr ? "" : prefixes), ':')) {
    if (!prefix.empty()) folders.push_back(std::filesystem::path(prefix.begin(), prefix.end()) / "share");
  }
  return folders;
}

bool is_served_by_another(const gate::ros::Node& node, std::string_view name,
                          const std::vector<world::OutsideSkill>& skills) {
  const auto wire_name = [&](std::string_view of) {
    return node.wire_name(of, gate::ros::Use::kTopic).value_or(std::string());
  };
  return std::ranges::any_of(
      skills, [&](const world::OutsideSkill& skill) { return wire_name(skill.server.text) == wire_name(name); });
}

std::optional<bridge::Resumption> outside_resumption(const gate::ros::OutsideSkills& skills, const task::Task& task,
                                                     std::size_t done) {
  if (done >= task.steps.size() || !skills.has(task.steps[done].skill)) return std::nullopt;
  return bridge::Resumption{done,
                            task::Outcome::kFailed,
                            fmt::format("its bridge was ended in the middle of it: what the server of '{}' has made of "
                                        "it is not known, and it is not asked again",
                                        task.steps[done].skill),
                            {{"stop", task::name(task::StopResult::kUncertain)}}};
}

}  // namespace pons::apps
