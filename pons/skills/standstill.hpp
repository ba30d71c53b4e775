// Whether the arm stands, by measurement.
#pragma once

#include <optional>

#include "pons/skills/arm.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

class Standstill {
 public:
  explicit Standstill(const Arm& arm) : arm_(arm) {}

  // The arm has been told to stop.
  void expect(Time now);
  // Once a tick from then on: nothing while that is still to be seen. Of an arm that the cerebellum has stopped, the
  // cerebellum's own finding. What nobody measures any more counts for nothing.
  [[nodiscard]] std::optional<task::StopResult> look(Time now);

 private:
  const Arm& arm_;
  Time since_, measured_;
  int still_ticks_ = 0;
};

}  // namespace pons::skills
