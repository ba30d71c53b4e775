#include "apps/dialects/dialect.hpp"

#include <algorithm>
#include <array>

#include "pons/bridge/journal/story.hpp"
#include "pons/task/json_value.hpp"

namespace pons::apps {
namespace {

constexpr std::array kCourse{
    bridge::kAcceptedEvent,   bridge::kStartedEvent,   bridge::kAttemptEvent,    bridge::kAskedEvent,
    bridge::kAllowedEvent,    bridge::kPausingEvent,   bridge::kPausedEvent,     bridge::kContinuedEvent,
    bridge::kPreemptingEvent, bridge::kPreemptedEvent, bridge::kRegainedEvent,   bridge::kHeldEvent,
    bridge::kReleasedEvent,   bridge::kResumedEvent,   bridge::kCancellingEvent, bridge::kHaltingEvent};

}  // namespace

bool is_course(const Saying& saying) {
  if (saying.event.is_null() || saying.state == Saying::State::kSucceeded || saying.state == Saying::State::kFailed)
    return true;
  return std::ranges::find(kCourse, task::text_of(saying.event, "kind")) != kCourse.end();
}

int priority_of(std::int64_t theirs) {
  constexpr int kOrdinary = 50;
  return kOrdinary + static_cast<int>(std::clamp<std::int64_t>(theirs, -kOrdinary, kOrdinary));
}

std::string_view three_words(Saying::State state) {
  if (state == Saying::State::kSucceeded) return "SUCCEEDED";
  return state == Saying::State::kFailed || state == Saying::State::kRefused ? "FAILED" : "EXECUTING";
}

}  // namespace pons::apps
