// The plane kinematics of a base on two driven wheels: what the wheels turn, and where that brings it. As the drawing
// has it; real wheels differ, and slip.
#pragma once

#include <cmath>

#include "pons/core/axes.hpp"
#include "pons/core/pose2.hpp"
#include "pons/world/world.hpp"

namespace pons::model {

// Along x and about z of the base.
struct Twist2 {
  double ahead = 0;  // m/s, or m, or a derivative of it
  double turn = 0;   // rad/s, or rad, likewise
};

class DiffDrive {
 public:
  explicit DiffDrive(const world::Base& base) : radius_m_(base.wheel_radius_m), half_track_m_(base.track_m / 2) {}

  // Of the wheels' angles, speeds or accelerations: the same of the base, and back.
  [[nodiscard]] Twist2 twist(const AxisVector& wheels) const {
    return {radius_m_ / 2 * (wheels[0] + wheels[1]), radius_m_ / 2 * (wheels[1] - wheels[0]) / half_track_m_};
  }
  [[nodiscard]] double left(const Twist2& twist) const {
    return (twist.ahead - half_track_m_ * twist.turn) / radius_m_;
  }
  [[nodiscard]] double right(const Twist2& twist) const {
    return (twist.ahead + half_track_m_ * twist.turn) / radius_m_;
  }

  // Where it is after the wheels have turned from one pair of angles to another at a constant ratio: along an arc.
  [[nodiscard]] Pose2 rolled(const Pose2& from, const AxisVector& before, const AxisVector& after) const {
    return along(from, twist(after - before));
  }
  [[nodiscard]] static Pose2 along(const Pose2& from, const Twist2& way) {
    const double half = way.turn / 2;
    const double chord = std::abs(half) < 1e-6 ? way.ahead : way.ahead * std::sin(half) / half;
    return {from.x + chord * std::cos(from.yaw + half), from.y + chord * std::sin(from.yaw + half),
            from.yaw + way.turn};
  }

 private:
  double radius_m_, half_track_m_;
};

}  // namespace pons::model
