// Decides when a run is over: everything sorted and quiet, or broken off and left safe.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pons/runner/run.hpp"

namespace pons::runner {

class Ending {
 public:
  // Both must outlive it.
  Ending(const Watch& watch, BridgeSide& bridge_side) : watch_(watch), bridge_side_(&bridge_side) {}

  // From now on that one, which has taken over; a run that was broken off stays so.
  void follow(BridgeSide& bridge_side, Time now);

  // Once a bridge period; `finished`: nothing more will come from the body. True when the run is over.
  [[nodiscard]] bool check(Time now, bool finished);
  [[nodiscard]] const std::string& broken_off() const { return broken_off_; }  // why; empty when it was not

 private:
  void break_off(Time now, std::string_view why);

  const Watch& watch_;
  BridgeSide* bridge_side_;
  std::optional<Time> quiet_since_;
  std::string broken_off_;
};

}  // namespace pons::runner
