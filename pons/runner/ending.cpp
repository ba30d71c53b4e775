#include "pons/runner/ending.hpp"

namespace pons::runner {
namespace {

// After the last parcel, so that cameras and carry-off see the end of it.
constexpr Duration kAfterwards = std::chrono::seconds(2);
// After a break, so that the arm comes to rest.
constexpr Duration kAfterBreak = std::chrono::milliseconds(500);

}  // namespace

bool Ending::check(Time now, bool finished) {
  if (!broken_off_ && watch_.interrupted && watch_.interrupted()) break_off(now, "interrupted");
  if (!broken_off_ && watch_.limit > Time{} && now > watch_.limit) break_off(now, "ran too long");
  if (watch_.progress) watch_.progress(now);
  if (!bridge_side_.idle() || !(broken_off_ || finished)) {
    quiet_since_.reset();
    return false;
  }
  if (!quiet_since_) quiet_since_ = now;
  return now - *quiet_since_ >= (broken_off_ ? kAfterBreak : kAfterwards);
}

void Ending::break_off(Time now, const char* why) {
  broken_off_ = true;
  bridge_side_.stop(now, why);
}

}  // namespace pons::runner
