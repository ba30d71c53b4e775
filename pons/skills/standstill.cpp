#include "pons/skills/standstill.hpp"

#include <algorithm>
#include <utility>

namespace pons::skills {
namespace {

using task::StopResult;

constexpr double kStill_rad_s = 0.02;  // of every axis: as the cerebellum has it
constexpr double kMoves_rad_s = 0.2;   // of one: then it has not stopped
constexpr int kStillTicks = 5;
constexpr Duration kWithin = std::chrono::seconds(1);  // of the end of its motion

}  // namespace

void Standstill::expect(Time now) {
  since_ = now;
  still_ticks_ = 0;
}

std::optional<StopResult> Standstill::look(Time now) {
  const link::State& state = arm_.state();
  switch (state.stop_result) {
    case link::StopResult::kConfirmed:
      return StopResult::kConfirmed;
    case link::StopResult::kUncertain:
      return StopResult::kUncertain;
    case link::StopResult::kFailed:
      return StopResult::kFailed;
    case link::StopResult::kPending:
      return std::nullopt;
    case link::StopResult::kNone:
      break;  // it is not the cerebellum that stops it
  }
  const double fastest_rad_s = state.speed.size() > 0 ? state.speed.cwiseAbs().maxCoeff() : 0;
  const Time stands_at = std::max(since_, arm_.motion_end());
  const bool is_new = state.stamp > std::exchange(measured_, std::max(measured_, state.stamp));
  if (now < stands_at || fastest_rad_s >= kStill_rad_s)
    still_ticks_ = 0;
  else if (is_new)
    ++still_ticks_;
  if (still_ticks_ >= kStillTicks) return StopResult::kConfirmed;
  if (now < stands_at + kWithin) return std::nullopt;
  return fastest_rad_s < kMoves_rad_s ? StopResult::kUncertain : StopResult::kFailed;
}

}  // namespace pons::skills
