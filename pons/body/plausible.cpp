#include "pons/body/plausible.hpp"

#include <algorithm>
#include <cmath>

namespace pons::body {
namespace {

// No sensor of an arm reads more in any of its units, but a belt's encoder, which only ever counts on.
constexpr double kLargest = 1e6;
constexpr double kFastest_rad_s = 300;  // a light wrist axis that is struck included
constexpr double kEncoders_rad = 0.02;

bool sensible(double value) { return std::abs(value) <= kLargest; }  // what is not a number is not

}  // namespace

bool is_sensible(const Sensors& sensors, Eigen::Index axes) PONS_NONBLOCKING {
  const auto all = [](const auto& values) { return std::all_of(values.begin(), values.end(), sensible); };
  return sensors.position.size() == axes && sensors.speed.size() == axes && all(sensors.position) &&
         (sensors.speed.array().abs() <= kFastest_rad_s).all() && all(sensors.wrist_force_n) &&
         all(sensors.wrist_torque_nm) && all(sensors.cup_vacuum_kpa) && std::isfinite(sensors.belt_travel_m) &&
         sensible(sensors.belt_speed_m_s);
}

bool follows(const Measured& before, const Measured& after, Duration passed) PONS_NONBLOCKING {
  const double half_s = 0.5 * to_s(passed);
  const auto off = after.position - before.position - half_s * (after.speed + before.speed);
  const auto unsure = (half_s + to_s(kCarriedOn)) * (after.speed - before.speed);
  return (off.array().abs() <= unsure.array().abs() + kEncoders_rad).all();
}

}  // namespace pons::body
