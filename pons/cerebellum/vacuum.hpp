// What the cups' pressures mean: a pure state machine, one step a tick.
#pragma once

#include <array>
#include <cstdint>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

struct VacuumSettings {
  double sealed_kpa;                                        // at or above: sealed
  int cups_to_lift;                                         // so many sealed: something is held
  double hysteresis = 0.9;                                  // share of sealed_kpa below which a cup is no longer sealed
  double open_share = 0.4;                                  // and below which it holds nothing
  Duration sealed_after = std::chrono::milliseconds(3);     // without a break,
  Duration unsealed_after = std::chrono::milliseconds(10);  // likewise,
  Duration lost_after = std::chrono::milliseconds(10);      // with none sealed

  static VacuumSettings of(const world::Tool& tool) {
    return {.sealed_kpa = tool.sealed_kpa, .cups_to_lift = tool.cups_to_lift};
  }
};

struct VacuumState {
  link::Vacuum seen;
  std::array<bool, kMaxCups> sealed{};
  std::array<Time, kMaxCups> steady_since{};  // when the pressure last agreed with `sealed`
  Time held_at;                               // when a cup was last sealed
};

// Whether a cup with that pressure may hold something. A value that is not a number may.
[[nodiscard]] inline bool holds(const VacuumSettings& settings, double vacuum_kpa) PONS_NONBLOCKING {
  return !(vacuum_kpa < settings.open_share * settings.sealed_kpa);
}

// The state at `now`, a tick after `before`.
[[nodiscard]] VacuumState next(const VacuumSettings& settings, const VacuumState& before, std::uint32_t vacuum_on,
                               const std::array<double, kMaxCups>& vacuum_kpa, Time now) PONS_NONBLOCKING;

}  // namespace pons::cerebellum
