#include "pons/skills/skills.hpp"

#include <memory>
#include <utility>

#include "pons/skills/detect.hpp"
#include "pons/skills/follow_policy.hpp"
#include "pons/skills/move_to.hpp"
#include "pons/skills/pick.hpp"
#include "pons/skills/place.hpp"
#include "pons/skills/press.hpp"
#include "pons/skills/yield.hpp"

namespace pons::skills {

namespace {

// Tells with each tick what the arm was asked for in it.
class Narrated final : public task::Skill {
 public:
  Narrated(Cell& cell, std::unique_ptr<task::Skill> skill) : cell_(cell), skill_(std::move(skill)) {}
  task::Progress tick(Time now) override {
    task::Progress progress = skill_->tick(now);
    progress.notes = cell_.take_notes();
    return progress;
  }
  void cancel(Time now) override { skill_->cancel(now); }

 private:
  Cell& cell_;
  std::unique_ptr<task::Skill> skill_;
};

task::SkillType narrated(Cell& cell, task::SkillType type) {
  type.start = [&cell, start = std::move(type.start)](const task::Json& arguments, Time now) {
    (void)cell.take_notes();  // of what the arm did between tasks
    auto skill = start(arguments, now);
    return skill ? std::make_unique<Narrated>(cell, std::move(skill)) : std::unique_ptr<Narrated>();
  };
  return type;
}

}  // namespace

void add_skills(task::SkillRegistry& registry, Cell& cell, const std::vector<std::string>& policies) {
  registry.add(narrated(cell, detect(cell)));
  registry.add(narrated(cell, follow_policy(cell, policies)));
  registry.add(narrated(cell, move_to(cell)));
  registry.add(narrated(cell, pick(cell)));
  registry.add(narrated(cell, place(cell)));
  registry.add(narrated(cell, press(cell)));
  registry.add(narrated(cell, yield(cell)));
}

}  // namespace pons::skills
