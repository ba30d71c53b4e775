#include "pons/body/plausible.hpp"

#include <cmath>
#include <span>

namespace pons::body {
namespace {

// No sensor of an arm reads more in any of its units, but a belt's encoder, which only ever counts on.
constexpr double kLargest = 1e6;
constexpr double kFastest_rad_s = 300;  // a light wrist axis that is struck included
constexpr double kEncoders_rad = 0.02;

// What is not a number is none of a sensor's.
bool all_sensible(std::span<const double> values) PONS_NONBLOCKING {
  for (const double value : values) {
    if (!(std::abs(value) <= kLargest)) return false;
  }
  return true;
}

}  // namespace

bool is_sensible(const Sensors& sensors, Eigen::Index axes) PONS_NONBLOCKING {
  return sensors.position.size() == axes && sensors.speed.size() == axes &&
         (sensors.position.array().abs() <= kLargest).all() && (sensors.speed.array().abs() <= kFastest_rad_s).all() &&
         all_sensible(sensors.wrist_force_n) && all_sensible(sensors.wrist_torque_nm) &&
         all_sensible(sensors.cup_vacuum_kpa) && std::isfinite(sensors.belt_travel_m) &&
         std::abs(sensors.belt_speed_m_s) <= kLargest;
}

bool follows(const Measured& before, const Measured& after, Duration passed) PONS_NONBLOCKING {
  const double half_s = 0.5 * to_s(passed);
  const auto off = after.position - before.position - half_s * (after.speed + before.speed);
  const auto unsure = (half_s + to_s(kCarriedOn)) * (after.speed - before.speed);
  return (off.array().abs() <= unsure.array().abs() + kEncoders_rad).all();
}

}  // namespace pons::body
