#include "pons/runner/ending.hpp"

#include <string>

namespace pons::runner {
namespace {

// After the last outcome, of a whole run or one that was broken off: what was let go falls and comes to rest, the arm
// does, and cameras and carry-off see the end of it.
constexpr Duration kAfterwards = std::chrono::seconds(2);

}  // namespace

bool Ending::check(Time now, bool finished) {
  if (!broken_off_ && watch_.interrupted && watch_.interrupted()) break_off(now, "interrupted");
  if (!broken_off_ && watch_.limit > Time{} && now > watch_.limit) break_off(now, "ran too long");
  if (watch_.progress) watch_.progress(now);
  for (const std::string& line : bridge_side_.health().take_alerts()) {
    if (watch_.alerted) watch_.alerted(line);
  }
  if (!bridge_side_.idle() || !(broken_off_ || finished)) {
    quiet_since_.reset();
    return false;
  }
  if (!quiet_since_) quiet_since_ = now;
  return now - *quiet_since_ >= kAfterwards;
}

void Ending::break_off(Time now, const char* why) {
  broken_off_ = true;
  bridge_side_.stop(now, why);
}

}  // namespace pons::runner
