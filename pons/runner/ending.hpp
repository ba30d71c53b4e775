// Decides when a run is over: everything sorted and quiet, or broken off and left safe.
#pragma once

#include <optional>

#include "pons/runner/run.hpp"

namespace pons::runner {

class Ending {
 public:
  // Both must outlive it.
  Ending(const Watch& watch, BridgeSide& bridge_side) : watch_(watch), bridge_side_(bridge_side) {}

  // Once a bridge period; `finished`: nothing more will come from the body. True when the run is over.
  [[nodiscard]] bool check(Time now, bool finished);
  [[nodiscard]] bool broken_off() const { return broken_off_; }

 private:
  void break_off(Time now, const char* why);

  const Watch& watch_;
  BridgeSide& bridge_side_;
  std::optional<Time> quiet_since_;
  bool broken_off_ = false;
};

}  // namespace pons::runner
