// Wall-clock pace: the cerebellum on a thread of its own with real-time priority where it is granted, the body's
// physics on another, vision on a third, the bridge on the caller's.
#pragma once

#include "pons/runner/run.hpp"

namespace pons::runner {

// Error: body, camera or journal failed. Either way every thread has ended when it returns.
[[nodiscard]] Expected<RunResult> run_realtime(Parts& parts, const Watch& watch);

}  // namespace pons::runner
