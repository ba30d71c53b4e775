// What is measured of each robot, once a bridge period, and how it fares by that. docs/degradation.md has the table of
// what each condition means and what the robot does then.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/health.hpp"
#include "pons/runner/skill_port.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// Each is told of once a period, in any order.
class RobotVitals {
 public:
  // Of several, each one's vacuum and loop bear its name in the table.
  enum class OneOf : std::uint8_t { kOne, kSeveral };
  // `robot` and `health` must outlive it.
  RobotVitals(const world::Robot& robot, std::string name, OneOf one_of, Health& health);

  // `kByPerson`: it is in a stop that only a person ends.
  enum class Resumes : std::uint8_t { kByItself, kByPerson };
  void arm(const link::State& state, Resumes resumes, Time now);
  // By the best cup's vacuum while something is sealed, held against the best of the run so far; how well they hold.
  [[nodiscard]] Grip vacuum(const link::State& state, Time now);
  void loop(const link::State& state, Time now);

 private:
  void measure_attempt(const link::State& state, Time now);

  const world::Robot& robot_;
  std::string name_, vacuum_, loop_;  // parts
  Health& health_;
  // From switching the cups on to switching them off.
  struct Attempt {
    Time began;
    std::optional<Time> sealed_since;
    double most_kpa = 0;
    bool sealed = false;
  };
  std::optional<Attempt> attempt_;
  double best_kpa_ = 0;  // that a seal has reached in this run
  double grip_share_ = 1;
  int too_weak_ = 0;  // attempts in a row
  Time too_weak_at_;
  struct Ticks {
    Time at;
    std::uint64_t count = 0;
  };
  std::optional<Ticks> ticks_;  // of the loop, when they were last counted
};

}  // namespace pons::runner
