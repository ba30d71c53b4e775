#include "pons/runner/ending.hpp"

#include <string>

namespace pons::runner {
namespace {

// After the last outcome, of a whole run or one that was broken off: what was let go falls and comes to rest, the arm
// does, and cameras and carry-off see the end of it.
constexpr Duration kAfterwards = std::chrono::seconds(2);

constexpr std::string_view kNobodyComes =
    "no robot goes on before a person resets it, and none can come; with --socket, `pons robot reset` can";

}  // namespace

bool Ending::check(Time now, bool finished) {
  if (watch_.interrupted && watch_.interrupted()) break_off(now, "interrupted");
  if (watch_.limit > Time{} && now > watch_.limit) break_off(now, "it ran too long");
  const bool done = finished && bridge_side_->idle();
  if (!watch_.attended && !done && bridge_side_->waits_for_person()) break_off(now, kNobodyComes);
  if (watch_.progress) watch_.progress(now);
  for (const std::string& line : bridge_side_->health().take_alerts()) {
    if (watch_.alerted) watch_.alerted(line);
  }
  if (!bridge_side_->idle() || (broken_off_.empty() && !finished)) {
    quiet_since_.reset();
    return false;
  }
  if (!quiet_since_) quiet_since_ = now;
  return now - *quiet_since_ >= kAfterwards;
}

void Ending::follow(BridgeSide& bridge_side, Time now) {
  bridge_side_ = &bridge_side;
  quiet_since_.reset();
  if (!broken_off_.empty()) bridge_side_->stop(now, broken_off_);
}

void Ending::break_off(Time now, std::string_view why) {
  if (!broken_off_.empty()) return;
  broken_off_ = why;
  bridge_side_->stop(now, broken_off_);
}

}  // namespace pons::runner
