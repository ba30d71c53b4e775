// Real time in two processes: a body's and a bridge's, which meet in a border. Either may be killed at any instant. The
// body then holds what it holds, and waits for another bridge; a bridge without its body ends.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "pons/link/border.hpp"
#include "pons/runner/run.hpp"

namespace pons::runner {

// How one process sees the other.
struct Crossing {
  link::Border* border = nullptr;
  std::function<bool()> other_lives;           // a system call: asked some ten times a second
  std::function<void(std::string_view)> tell;  // a line for people: who came, who went
};

// On the body's main thread, when its parts stand ready: begins the run once a bridge is ready, and ends when a bridge
// has closed it or, interrupted, when none is there to close it. Watch::progress and limit are the bridge's and not
// called here. Error: body or camera failed.
[[nodiscard]] Expected<RunResult> run_body_process(BodyParts& parts, const Crossing& crossing, const Watch& watch);

// Waits, as long as `limit`, until a body owns that name.
void await_body(const std::string& name, Duration limit, const std::function<bool()>& interrupted);
// Waits, as long as `limit`, until the other side has gone. False: it has not.
[[nodiscard]] bool await_departure(const Crossing& crossing, Duration limit);
// Waits until the body has begun the run and the first state has come. Error: the body has gone, or ends.
[[nodiscard]] Expected<void> await_begin(const Crossing& crossing, const std::function<bool()>& interrupted);

// What every error means that comes from a body that is no more.
inline constexpr std::string_view kBodyGone = "the body has gone";

// On the bridge's main thread, after await_begin(). Error: the body has gone (kBodyGone), or the journal failed.
[[nodiscard]] Expected<RunResult> run_bridge_process(BridgeSide& bridge_side, Observer& observer,
                                                     const Crossing& crossing, const Watch& watch);

}  // namespace pons::runner
