// Whether what is asked of the arm keeps its limits, each tick; and how near it came to them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"

namespace pons::cerebellum {

// The largest share of a limit that was used: 1 = exactly at it.
struct LimitUse {
  double speed = 0, acceleration = 0, jerk = 0, torque = 0;
};

// Of a whole run. The commanded figures hold for every tick with power; the measured ones for every fresh measurement.
struct Statistics {
  LimitUse commanded;         // what was sent to the arm
  double asked_torque = 0;    // share of the limit before the torque was clamped to it
  double measured_speed = 0;  // share of the limit
  double measured_acceleration = 0;
  double following_error_rad = 0;        // largest
  std::uint64_t violations = 0;          // ticks in which a command sent to the arm broke a limit: must stay 0
  double contact = 0;                    // largest share of what passes for no collision, while it moves
  std::uint64_t measured_overspeed = 0;  // fresh measurements above a speed limit
  std::uint64_t saturated = 0;           // ticks with a torque clamped
  std::uint64_t refused = 0;             // ticks in which a sample was refused before it was sent
  std::uint64_t stops = 0;               // of any kind

  // Of another loop of the same run.
  void add(const Statistics& other);
};

enum class Limit : std::uint8_t { kPosition, kSpeed, kAcceleration, kJerk, kContinuity, kStoppingDistance };
[[nodiscard]] std::string_view name(Limit limit);

struct Breach {
  Eigen::Index axis;
  Limit limit;
};

class LimitWatch {
 public:
  // `limits` must outlive it.
  explicit LimitWatch(const AxisLimits& limits) : limits_(limits) {}

  // Why `next` may not follow `previous` after dt_s, if so: position, speed, acceleration beyond their limits, the
  // change of acceleration beyond the jerk limit, a position or speed that no motion within the limits leads to in that
  // time, or no way left to stop inside the position and speed limits.
  // Tolerances: 1e-6 rad, 1e-6 of each rate, and what a seam may add (SeamTolerance).
  [[nodiscard]] std::optional<Breach> breach(const AxisState& previous, const AxisState& next,
                                             double dt_s) const PONS_NONBLOCKING;
  // The same of what bounds no jerk and looks at no way to stop.
  [[nodiscard]] std::optional<Breach> breach_but_jerk(const AxisState& previous, const AxisState& next,
                                                      double dt_s) const PONS_NONBLOCKING;
  // Why no stop within the limits is left from a state, if so.
  [[nodiscard]] std::optional<Breach> breach_ahead(const AxisState& state) const PONS_NONBLOCKING;
  // Records what was sent; counts it as a violation if it broke a limit all the same.
  void record(const AxisState& previous, const AxisState& next, double dt_s,
              Statistics& statistics) const PONS_NONBLOCKING;

 private:
  [[nodiscard]] std::optional<Breach> breach_now(const AxisState& previous, const AxisState& next, double dt_s) const;
  [[nodiscard]] std::optional<Breach> beyond(const AxisState& state) const;
  const AxisLimits& limits_;
};

}  // namespace pons::cerebellum
