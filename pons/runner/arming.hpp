// Who leads the arm out of a stop: the bridge by itself where the cause allows that, else a person, who first resets
// and then arms. Also what a person may ask of the arm beside that.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/core/error.hpp"
#include "pons/runner/skill_port.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// Whether an arm that is found outside its position limits may be brought in; else the run ends and says so.
enum class Recovery : std::uint8_t { kRefused, kAllowed };

// One thread, the bridge's.
class Arming {
 public:
  // All must outlive it. `zones` are the world's.
  Arming(bridge::Bridge& bridge, const SkillPort& skills, const std::vector<world::Zone>& zones, Recovery recovery);

  // After a bridge that is no more: stops an arm that still moves as that one told it to. An arm that was armed before
  // settles before it is used.
  void take_over(Time now, bool armed_before);
  // Likewise, before that: a word that the journal has, in the order in which they stand there.
  void recall(std::string_view word);
  // Once a period: one step on the way out of a stop, if it may be left; the bridge is held meanwhile. What the arm and
  // the zones do goes into the journal. Error: the arm stands where it may not be armed; the run cannot go on.
  [[nodiscard]] Expected<void> tick(Time now);

  // A person's words; what has come of them shows in what describe() says later. Errors: what stands in the way.
  // Stops the arm; without a person it does not move again.
  void stop(Time now);
  void emergency_stop(Time now);
  // Leaves a stop that needs a person, and lets go of the emergency word. Moves nothing, arms nothing.
  [[nodiscard]] Expected<void> reset(Time now);
  // Lets the arm be armed that a person has reset.
  [[nodiscard]] Expected<void> arm(Time now);
  // {"state", "cause", "standstill", "epoch", "needs"}: the last is what the arm waits for, empty when it works.
  [[nodiscard]] bridge::Json describe() const;

  // It does not move again without a person.
  [[nodiscard]] bool needs_person() const { return needs_person_; }
  // The arm is still being brought out of where a bridge that is no more has left it; nothing else may move it.
  [[nodiscard]] bool settles() const { return took_over_; }
  [[nodiscard]] std::int64_t stops() const { return stops_; }
  // Times the arm came to need a person: by a cause that only one may reset, or by one's own word.
  [[nodiscard]] std::int64_t interventions() const { return interventions_; }
  // For the report, before take_over(): so many there were before this bridge came, and whether the last one lasts.
  struct Interventions {
    std::int64_t count = 0;
    bool lasts = false;
  };
  void begin_with(const Interventions& before) { interventions_ = before.count, counted_ = before.lasts; }

 private:
  void need_person();
  void note_person(std::string_view word, Time now);
  void look_around(Time now);
  void note_changes(const link::State& state, Time now);
  [[nodiscard]] Expected<void> lead_out(const link::State& state, Time now);
  [[nodiscard]] Expected<void> bring_in(Time now);
  [[nodiscard]] bool may_resume(const link::State& state, Time now) const;
  [[nodiscard]] bool needs_person(const link::State& state) const;
  [[nodiscard]] bool zones_are_empty(const link::State& state, Time now) const;

  bridge::Bridge& bridge_;
  const SkillPort& skills_;
  const std::vector<world::Zone>& zones_;
  Recovery recovery_;
  std::optional<Time> stopped_since_;
  struct Recovering {
    Duration for_so_long;
    Time at;
  };
  std::optional<Recovering> recovering_;     // since the arm was last operational, or in a person's hands
  std::array<Time, kMaxZones> occupied_at_;  // when somebody was last seen there, or heard of
  std::uint32_t zones_occupied_ = 0, zones_entered_ = 0;
  std::int64_t stops_ = 0, interventions_ = 0;
  bool needs_person_ = false;  // to reset and to arm
  bool counted_ = false;       // that it does, by a bridge that is no more
  bool was_operational_ = false;
  bool took_over_ = false;  // and the arm has not settled since
  bool yielding_ = false;   // it still moves as it was told before
};

}  // namespace pons::runner
