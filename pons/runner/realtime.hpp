// Wall-clock pace: the body's side on threads of its own, vision on another, the bridge on the caller's.
#pragma once

#include "pons/rt/clock.hpp"
#include "pons/rt/wake_word.hpp"
#include "pons/runner/refusals.hpp"
#include "pons/runner/run.hpp"

namespace pons::runner {

// Both sides in this process. Error: body, camera or journal failed, or nothing has come from the control loop for a
// second. Either way every thread has ended when it returns, but for a loop's that is stuck: that one is left behind,
// and should it ever go on, looks at `parts` once more. End the process then.
[[nodiscard]] Expected<RunResult> run_realtime(Parts& parts, const Watch& watch);

// What the bridge's side knows of a body that moves elsewhere. All are asked once a period.
struct BodyView {
  const rt::MonotonicClock* clock = nullptr;  // the run's
  const rt::WakeWord* gone = nullptr;         // changes when no body paces the clock any more
  std::function<bool()> finished;             // nothing more will come
  std::function<Expected<void>()> health;     // an error ends the run
};

// The bridge's side alone, on the caller's thread, which notes in `refusals` what it was refused before its first tick;
// the loop's figures stay empty. Error: the body's, or the journal's.
[[nodiscard]] Expected<RunResult> run_bridge(BridgeSide& bridge_side, Observer& observer, const BodyView& body,
                                             Refusals& refusals, const Watch& watch);

}  // namespace pons::runner
