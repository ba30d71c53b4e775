#include "pons/runner/arming.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <utility>

#include "pons/cerebellum/safety_machine.hpp"

namespace pons::runner {
namespace {

using bridge::Json;
using link::SafetyState;

// A stop whose cause has passed is left again after this long at standstill.
constexpr Duration kStandstillBeforeReset = std::chrono::milliseconds(500);

// So far outside its limits, by sagging or by a hand, an arm is brought in unasked: slowly, as any recovery.
constexpr double kBroughtInUnasked_rad = 0.01;

// Stops on the way not counted: then something holds it outside.
constexpr Duration kLongestRecovery = std::chrono::seconds(60);

constexpr std::string_view kArm = "arm";  // the word after which no person is needed any more

bool has(std::uint32_t zones, std::size_t i) { return ((zones >> i) & 1U) != 0; }

bool is_stopped(const link::State& state) {
  return state.safety == SafetyState::kProtectiveStop || state.safety == SafetyState::kEmergencyStop;
}

bool is_emergency(const link::State& state) {
  return state.safety == SafetyState::kEmergencyStopping || state.safety == SafetyState::kEmergencyStop;
}

bool stands(const link::State& state) { return is_stopped(state) && state.stop_result == link::StopResult::kConfirmed; }

cerebellum::Resumes resumes(const link::State& state) {
  const cerebellum::CauseRow* const row = cerebellum::cause_row(state.cause);
  return row == nullptr ? cerebellum::Resumes::kPerson : row->resumes;
}

}  // namespace

Arming::Arming(bridge::Bridge& bridge, const SkillPort& skills, const std::vector<world::Zone>& zones,
               Recovery recovery)
    : bridge_(bridge), skills_(skills), zones_(zones), recovery_(recovery) {}

void Arming::take_over(Time now, bool armed_before) {
  took_over_ = armed_before || skills_.state().safety != SafetyState::kDisarmed;
  yielding_ = skills_.state().safety == SafetyState::kOperational;
  if (yielding_) skills_.halt();
  look_around(now);
}

Expected<void> Arming::tick(Time now) {
  look_around(now);
  const link::State& state = skills_.state();
  yielding_ = yielding_ && state.safety == SafetyState::kOperational;
  if (is_stopped(state) && needs_person(state)) need_person();
  const bool operational = state.safety == SafetyState::kOperational && !yielding_ && !needs_person_;
  if (operational && took_over_) took_over_ = !skills_.settle(now);
  using Hold = bridge::Bridge::Hold;
  const bool free = operational && !took_over_;
  bridge_.hold(free ? Hold::kOff : needs_person_ ? Hold::kGone : Hold::kOn, skills_.robot);
  note_changes(state, now);
  if (operational) {
    stopped_since_.reset();
    recovering_.reset();
    return {};
  }
  if (!stopped_since_) stopped_since_ = now;
  return lead_out(state, now);
}

void Arming::note_changes(const link::State& state, Time now) {
  const bool operational = state.safety == SafetyState::kOperational && !yielding_;
  if (is_emergency(state)) bridge_.emergency_stop(now, link::name(state.cause), skills_.robot);
  if (operational) bridge_.released(now, skills_.robot);
  if (was_operational_ && !operational) {
    ++stops_;
    bridge_.note("stop",
                 {{"robot", skills_.name}, {"state", link::name(state.safety)}, {"cause", link::name(state.cause)}},
                 now);
  } else if (!was_operational_ && operational) {
    bridge_.note("armed", {{"robot", skills_.name}, {"epoch", state.epoch}}, now);
  }
  was_operational_ = operational;
}

Expected<void> Arming::lead_out(const link::State& state, Time now) {
  if (needs_person_) {
    recovering_.reset();
    if (state.safety == SafetyState::kOperational) skills_.halt();
    return {};
  }
  const bool recovers = state.safety == SafetyState::kRecovery;
  if (recovers || (state.safety == SafetyState::kDisarmed && skills_.outside_rad() > 0)) return bring_in(now);
  if (state.safety == SafetyState::kDisarmed || (stands(state) && may_resume(state, now))) skills_.arm(now);
  return {};
}

Expected<void> Arming::bring_in(Time now) {
  const double outside_rad = skills_.outside_rad();
  if (!recovering_ && recovery_ == Recovery::kRefused && outside_rad > kBroughtInUnasked_rad) {
    return fail(fmt::format("an axis stands {:.3f} rad outside its position limits", outside_rad), "arm",
                "see that its way in is clear and allow it with --recover, or bring it in by hand");
  }
  if (!recovering_) {
    bridge_.note("recovery", {{"robot", skills_.name}, {"outside_rad", outside_rad}}, now);
    recovering_ = Recovering{.for_so_long = Duration{0}, .at = now};
  }
  const Duration since = now - std::exchange(recovering_->at, now);
  if (since < kStandstillBeforeReset) recovering_->for_so_long += since;  // else it was stopped in between
  if (outside_rad > 0 && recovering_->for_so_long > kLongestRecovery) {
    return fail(fmt::format("after {:.0f} s an axis still stands {:.3f} rad outside its position limits",
                            to_s(kLongestRecovery), outside_rad),
                "arm", "see what holds it there, and bring it in by hand");
  }
  return skills_.recover(now);
}

void Arming::need_person() {
  if (!std::exchange(needs_person_, true) && !std::exchange(counted_, false)) ++interventions_;
}

// From a stop at rest.
bool Arming::may_resume(const link::State& state, Time now) const {
  return zones_are_empty(state, now) && now - *stopped_since_ >= kStandstillBeforeReset;
}

// Who is where, into the journal. A visit may be shorter than a period, or have begun before this bridge did: the loop
// remembers those that matter, and when they ended is then taken to be now.
void Arming::look_around(Time now) {
  const link::State& state = skills_.state();
  const std::uint32_t occupied = state.zones_occupied | (state.zones_entered & ~zones_entered_);
  for (std::size_t i = 0; i < zones_.size(); ++i) {
    const bool is = has(occupied, i), was = has(zones_occupied_, i);
    if (is) occupied_at_[i] = now;
    if (is != was) bridge_.note("zone", {{"zone", zones_[i].name}, {"occupied", is}}, now);
  }
  zones_occupied_ = occupied;
  zones_entered_ = state.zones_entered;
}

bool Arming::needs_person(const link::State& state) const {
  if (resumes(state) == cerebellum::Resumes::kPerson) return true;
  for (std::size_t i = 0; i < zones_.size(); ++i) {
    if (has(state.zones_entered, i) && !zones_[i].resume_after_s) return true;
  }
  return false;
}

// Of those that stop, for as long as each of them wants.
bool Arming::zones_are_empty(const link::State& state, Time now) const {
  for (std::size_t i = 0; i < zones_.size(); ++i) {
    if (has(state.zones_entered, i) && now - occupied_at_[i] < from_s(zones_[i].resume_after_s.value_or(0)))
      return false;
  }
  return true;
}

void Arming::recall(std::string_view word) { needs_person_ = word != kArm; }

// Durable at once: a bridge that comes after this one must wait for the same person. What cannot be written shows in
// the bridge's next tick.
void Arming::note_person(std::string_view word, Time now) {
  bridge_.note("person", {{"robot", skills_.name}, {"asks", word}}, now);
  (void)bridge_.commit(now);
}

// The arm first: a disk may keep one waiting.
void Arming::stop(Time now) {
  skills_.halt();
  need_person();
  note_person("stop", now);
}

void Arming::emergency_stop(Time now) {
  skills_.raise_emergency();
  need_person();
  note_person("emergency stop", now);
}

Expected<void> Arming::reset(Time now) {
  const link::State& state = skills_.state();
  const std::string is = fmt::format("the arm's state is: {}", link::name(state.safety));
  if (!needs_person_) return fail(is, "reset", "only a stop that needs a person is reset by one");
  if (!is_stopped(state))
    return fail(is, "reset", "there is nothing to reset; ask again when it has stopped, or arm it");
  if (!stands(state)) {
    return fail(fmt::format("standstill is {}", link::name(state.stop_result)), "reset",
                "ask again when the arm stands; pons robot show says so");
  }
  note_person("reset", now);
  skills_.release_emergency();
  skills_.arm(now);
  return {};
}

Expected<void> Arming::arm(Time now) {
  const link::State& state = skills_.state();
  if (state.safety != SafetyState::kDisarmed) {
    return fail(
        fmt::format("the arm's state is: {}", link::name(state.safety)), "arm",
        needs_person_ || is_stopped(state) ? "reset it first: pons robot reset" : "only a disarmed arm is armed");
  }
  note_person(kArm, now);
  needs_person_ = counted_ = false;
  return {};
}

Json Arming::describe() const {
  const link::State& state = skills_.state();
  const auto needs = [&]() -> std::string_view {
    if (state.safety == SafetyState::kOperational) return needs_person_ ? "standstill" : "";
    if (state.safety == SafetyState::kRecovery) return "to come inside its position limits";
    if (state.safety == SafetyState::kDisarmed)
      return needs_person_ ? "a person who arms it: pons robot arm" : "arming";
    if (!stands(state)) return "standstill";
    if (needs_person_) return "a person who resets it: pons robot reset";
    return state.zones_entered != 0 ? "the zone to be empty" : "a moment";
  };
  return {{"state", link::name(state.safety)},
          {"cause", link::name(state.cause)},
          {"standstill", link::name(state.stop_result)},
          {"epoch", state.epoch},
          {"needs", needs()}};
}

}  // namespace pons::runner
