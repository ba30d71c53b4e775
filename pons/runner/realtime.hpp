// Wall-clock pace: the cerebellum on a thread of its own with real-time priority where it is granted, the body's
// physics on another, vision on a third, the bridge on the caller's.
#pragma once

#include "pons/runner/run.hpp"

namespace pons::runner {

// Error: body, camera or journal failed, or nothing has come from the control loop for a second. Either way every
// thread has ended when it returns, but for a loop's that is stuck: that one is left behind, and should it ever go on,
// looks at `parts` once more. End the process then.
[[nodiscard]] Expected<RunResult> run_realtime(Parts& parts, const Watch& watch);

}  // namespace pons::runner
