// One deterministic schedule in virtual time, as fast as the processor allows: the same seed gives the same bytes.
#pragma once

#include "pons/runner/run.hpp"

namespace pons::runner {

// Error: body, camera or journal failed.
[[nodiscard]] Expected<RunResult> run_lockstep(Parts& parts, const Watch& watch);

}  // namespace pons::runner
