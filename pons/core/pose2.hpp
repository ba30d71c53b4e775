// Poses on a floor: two coordinates and a heading. As in pose.hpp, a_from_b maps coordinates in b to those in a.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace pons {

using Vector2 = Eigen::Vector2d;

// The same direction in (-π, π].
[[nodiscard]] inline double wrapped(double angle_rad) {
  const double turned = std::remainder(angle_rad, 2 * std::numbers::pi);
  return turned <= -std::numbers::pi ? turned + 2 * std::numbers::pi : turned;
}

struct Pose2 {
  double x = 0, y = 0;  // m
  double yaw = 0;       // rad, about +z; not wrapped

  [[nodiscard]] Vector2 position() const { return {x, y}; }
  [[nodiscard]] Vector2 ahead() const { return {std::cos(yaw), std::sin(yaw)}; }
  bool operator==(const Pose2&) const = default;
};

[[nodiscard]] inline Vector2 operator*(const Pose2& a_from_b, const Vector2& in_b) {
  const double c = std::cos(a_from_b.yaw), s = std::sin(a_from_b.yaw);
  return {a_from_b.x + c * in_b.x() - s * in_b.y(), a_from_b.y + s * in_b.x() + c * in_b.y()};
}

[[nodiscard]] inline Pose2 operator*(const Pose2& a_from_b, const Pose2& b_from_c) {
  const Vector2 at = a_from_b * b_from_c.position();
  return {at.x(), at.y(), a_from_b.yaw + b_from_c.yaw};
}

[[nodiscard]] inline Pose2 inverse(const Pose2& a_from_b) {
  const double c = std::cos(a_from_b.yaw), s = std::sin(a_from_b.yaw);
  return {-c * a_from_b.x - s * a_from_b.y, s * a_from_b.x - c * a_from_b.y, -a_from_b.yaw};
}

}  // namespace pons
