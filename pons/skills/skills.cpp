#include "pons/skills/skills.hpp"

#include "pons/skills/detect.hpp"
#include "pons/skills/follow_path.hpp"
#include "pons/skills/follow_policy.hpp"
#include "pons/skills/follow_trajectory.hpp"
#include "pons/skills/move_to.hpp"
#include "pons/skills/pick.hpp"
#include "pons/skills/place.hpp"
#include "pons/skills/press.hpp"
#include "pons/skills/servo.hpp"
#include "pons/skills/yield.hpp"

namespace pons::skills {

void add_skills(task::SkillRegistry& registry, Cell& cell, const std::vector<std::string>& policies) {
  registry.add(detect(cell));
  registry.add(follow_path(cell));
  registry.add(follow_policy(cell, policies));
  registry.add(follow_trajectory(cell));
  registry.add(move_to(cell));
  registry.add(pick(cell));
  registry.add(place(cell));
  registry.add(press(cell));
  registry.add(servo(cell));
  registry.add(yield(cell));
}

}  // namespace pons::skills
