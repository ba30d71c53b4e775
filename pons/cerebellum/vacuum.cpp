#include "pons/cerebellum/vacuum.hpp"

namespace pons::cerebellum {
namespace {

using link::VacuumPhase;

VacuumPhase next_phase(const VacuumSettings& settings, const VacuumState& state, VacuumPhase before,
                       std::uint32_t vacuum_on, Time now) {
  if (vacuum_on == 0) return state.seen.open ? VacuumPhase::kOff : VacuumPhase::kReleasing;
  if (state.seen.sealed_cups >= settings.cups_to_lift) return VacuumPhase::kSealed;
  if (before == VacuumPhase::kSealed) {
    return state.seen.sealed_cups == 0 && now - state.held_at >= settings.lost_after ? VacuumPhase::kLost : before;
  }
  return before == VacuumPhase::kLost ? before : VacuumPhase::kBuilding;
}

}  // namespace

VacuumState next(const VacuumSettings& settings, const VacuumState& before, std::uint32_t vacuum_on,
                 const std::array<double, kMaxCups>& vacuum_kpa, Time now) PONS_NONBLOCKING {
  VacuumState state = before;
  state.seen.sealed_cups = 0;
  state.seen.open = true;
  for (std::size_t cup = 0; cup < kMaxCups; ++cup) {
    const double kpa = vacuum_kpa[cup];
    const double threshold = (before.sealed[cup] ? settings.hysteresis : 1.0) * settings.sealed_kpa;
    if ((kpa >= threshold) == before.sealed[cup]) {
      state.steady_since[cup] = now;
    } else if (now - before.steady_since[cup] >=
               (before.sealed[cup] ? settings.unsealed_after : settings.sealed_after)) {
      state.sealed[cup] = !before.sealed[cup];
      state.steady_since[cup] = now;
    }
    if (state.sealed[cup]) ++state.seen.sealed_cups;
    if (holds(settings, kpa)) state.seen.open = false;
  }
  if (state.seen.sealed_cups > 0) state.held_at = now;
  state.seen.phase = next_phase(settings, state, before.seen.phase, vacuum_on, now);
  return state;
}

}  // namespace pons::cerebellum
