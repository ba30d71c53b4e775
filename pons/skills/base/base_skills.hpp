// What a base can do: drive somewhere, dock, look around, speak.
#pragma once

#include <functional>

#include "pons/skills/base/chassis.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/speech.hpp"

namespace pons::skills {

[[nodiscard]] task::SkillType navigate(Chassis& chassis);
// To the station of that name, which holds the resource of that name, too.
[[nodiscard]] task::SkillType dock(Chassis& chassis);
// As somebody steers: with Chassis::wish(), for as long as it is renewed and `wanted`, asked each tick, does not say
// that a task waits for the base.
[[nodiscard]] task::SkillType drive(Chassis& chassis, std::function<bool()> wanted);
inline constexpr Duration kSteeredFor = std::chrono::milliseconds(500);  // by one wish
[[nodiscard]] task::SkillType scan(Chassis& chassis);
[[nodiscard]] task::SkillType speak(task::Speech& speech);

// Where {"x", "y", "yaw"} or {"place"} leads; "yaw" may be left out, and is 0 then. Error: neither or both, or the map
// has no room for the base there.
[[nodiscard]] Expected<Pose2> goal_of(const task::Json& arguments, const world::World& world);

// All of them; both must outlive the registry. The dock's only where there is a station "dock".
void add_base_skills(task::SkillRegistry& registry, Chassis& chassis, task::Speech& speech,
                     std::function<bool()> wanted = {});

}  // namespace pons::skills
