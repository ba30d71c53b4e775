// What all skills that move the arm do alike when they are told to pause, go on, stop or halt.
#pragma once

#include <memory>

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// A skill as far as it is its own.
class ArmSkill {
 public:
  virtual ~ArmSkill() = default;
  [[nodiscard]] virtual task::Progress tick(Time now) = 0;
  virtual void cancel(Time now) = 0;
  // Asked each tick while a pause is wanted. True: here the arm may be brought to rest, and the next tick() goes on
  // from wherever it then stands, with nothing planned. False: it must be ticked on first.
  [[nodiscard]] virtual bool may_rest(Time now, task::Pause pause) = 0;
  // Before that next tick: it rested for so long.
  virtual void go_on(Time now, Duration rested) = 0;
};

// The skill as the bridge sees it. It says that it is paused, and after cancel() or halt() that it has ended, once
// standstill was measured, or was not within a second. Paused, the arm keeps clear of what rides along. A halt is a
// protective stop: whatever the arm was at, it stays there, and the cups hold what they hold. Before it begins, or goes
// on, what another has left on the cups is let go of when nobody knows it, and weighed when nobody has. With each tick
// it tells what the arm was asked for in it.
[[nodiscard]] std::unique_ptr<task::Skill> conduct(Cell& cell, std::unique_ptr<ArmSkill> skill);

}  // namespace pons::skills
