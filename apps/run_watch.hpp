// What a run tells people while it goes on: on the error stream, in the loop's log, and over /rosout.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

#include "apps/ros_node.hpp"
#include "apps/run_along.hpp"
#include "apps/run_kit.hpp"
#include "pons/core/time.hpp"
#include "pons/runner/run.hpp"

namespace pons::apps {

struct Told {
  std::function<void(std::string_view)> people;                         // a line, with its line feed
  std::function<void(std::uint8_t, Time, std::string_view)> onlookers;  // likewise; a level of LogView::Log's
  std::function<RosNode*()> ros;                                        // who warns; null: nobody
  LoopLog* log = nullptr;                                               // null: the loop is another process's
  Alerts alerts = Alerts::kTold;                                        // to people; the journal tells onlookers
  Time begin;                                                           // of the run
};

// Tells what comes up, until `along` asks to end; whoever runs adds what he alone knows. `along` and the log outlive
// it.
[[nodiscard]] runner::Watch watch_for(Told told, const RunAlong& along);

}  // namespace pons::apps
