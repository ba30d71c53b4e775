// What the skills that drive have in common: the verbs. Each leads to rest along the limits, but for halt(), which is
// the loop's own stop.
#pragma once

#include <cstdint>
#include <optional>

#include "pons/skills/base/chassis.hpp"
#include "pons/skills/standstill.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

class Driven : public task::Skill {
 public:
  Driven(const Driven&) = delete;
  Driven& operator=(const Driven&) = delete;

  task::Progress tick(Time now) override;
  void pause(Time now, task::Pause pause) final;
  void resume(Time now) final;
  void cancel(Time now) final;
  void halt(Time now) final;

 protected:
  // `chassis` outlives it.
  explicit Driven(Chassis& chassis) : chassis_(chassis), standstill_(chassis.wheels) {}

  // Once a tick, unless it was told otherwise.
  [[nodiscard]] virtual task::Progress go(Time now) = 0;
  // It goes on after a pause; what was planned is of a place where it may no longer be.
  virtual void begin_anew() = 0;
  void brake(Time now);
  // Of its own accord: brakes, and ends so once it stands.
  void end(Time now, task::Progress verdict);

  Chassis& chassis_;

 private:
  enum class Mode : std::uint8_t { kGoes, kRests, kEnds, kHalts };
  void stop(Time now, Mode mode);
  [[nodiscard]] task::Progress rest(Time now, task::Progress verdict);
  [[nodiscard]] task::Progress halted(Time now);

  Standstill standstill_;
  Mode mode_ = Mode::kGoes;
  std::optional<task::Progress> ends_as_;
  Time halted_at_;
  std::optional<task::StopResult> stands_;
};

}  // namespace pons::skills
