// Joint-space vectors of a fixed capacity: no allocation, so they may cross the link and live in the loop.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

namespace pons {

inline constexpr std::size_t kMaxAxes = 8;     // the longest kinematic chain a robot file may name
inline constexpr std::size_t kMaxCups = 8;     // suction cups of one gripper
inline constexpr std::size_t kMaxZones = 16;   // watched zones of one cell
inline constexpr std::size_t kMaxPlaces = 64;  // places of one cell
inline constexpr std::size_t kMaxArms = 4;     // along one belt

// One value a joint, in the order of the robot file. Eigen with a compile-time ceiling: size() is the robot's own axis
// count, storage is inline.
using AxisVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, static_cast<int>(kMaxAxes), 1>;

// A force (N) and a moment (N·m), or a twist (m/s, rad/s): the straight part first.
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Where the axes of each arm along a belt are, in their order; of a single robot the first.
struct ArmPositions {
  ArmPositions() = default;
  template <typename Positions>
  ArmPositions(const Eigen::MatrixBase<Positions>& only)  // NOLINT(google-explicit-constructor)
      : of{AxisVector(only)} {}
  std::array<AxisVector, kMaxArms> of;  // rad
};

// Limits that hold in every tick. Rates are symmetric; all entries are positive except position_min.
struct AxisLimits {
  AxisVector position_min;         // rad
  AxisVector position_max;         // rad
  AxisVector speed_rad_s;          // rad/s
  AxisVector acceleration_rad_s2;  // rad/s²
  AxisVector jerk_rad_s3;          // rad/s³
  AxisVector torque_nm;            // N·m
};

// Where a joint-space motion is at one moment.
struct AxisState {
  AxisVector position;      // rad
  AxisVector speed;         // rad/s
  AxisVector acceleration;  // rad/s²
};

[[nodiscard]] inline AxisState at_rest(const AxisVector& position) {
  return {position, AxisVector::Zero(position.size()), AxisVector::Zero(position.size())};
}

}  // namespace pons
