// Inside motion: a straight way of the tool, and what it may be off it.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pons/core/pose.hpp"

namespace pons::motion {

inline constexpr double kOff_m = 1e-4, kOff_rad = 0.01 * std::numbers::pi / 180;

// The tool's way along a line: position straight, orientation by SLERP (Shoemake 1985), both by one share of the way.
class Straight {
 public:
  Straight(const Pose& from, const Pose& to) : from_(from), turned_(from.linear()), to_(to.linear()) {
    way_ = to.translation() - from.translation();
    if (turned_.dot(to_) < 0) to_.coeffs() = -to_.coeffs();
    turn_rad_ = turned_.angularDistance(to_);
    axis_ = (turned_.conjugate() * to_).vec().stableNormalized();
  }
  [[nodiscard]] Pose at(double share) const {
    Pose pose = Pose::Identity();
    pose.linear() = turned_.slerp(share, to_).toRotationMatrix();
    pose.translation() = from_.translation() + share * way_;
    return pose;
  }
  [[nodiscard]] double length_m() const { return way_.norm(); }
  [[nodiscard]] double turn_rad() const { return turn_rad_; }

  // Whether the tip is on the line, to its tolerances: place and orientation at one share of the way.
  [[nodiscard]] bool holds(const Pose& tip) const {
    const Pose should = at(share_of(tip));
    const Eigen::AngleAxisd wrong(tip.linear().transpose() * should.linear());
    return (tip.translation() - should.translation()).norm() <= kOff_m && std::abs(wrong.angle()) <= kOff_rad;
  }

 private:
  // By way or turn, whichever tells it better: a turn in place has no way, and a hair's breadth of one tells nothing.
  [[nodiscard]] double share_of(const Pose& tip) const {
    if (length_m() / kOff_m >= turn_rad_ / kOff_rad) {
      return std::clamp((tip.translation() - from_.translation()).dot(way_) / way_.squaredNorm(), 0.0, 1.0);
    }
    const Eigen::Quaterniond gone = turned_.conjugate() * Eigen::Quaterniond(tip.linear());
    double angle = 2 * std::atan2(gone.vec().dot(axis_), gone.w());
    if (angle < -std::numbers::pi) angle += 2 * std::numbers::pi;  // the quaternion's other sign
    return std::clamp(angle / turn_rad_, 0.0, 1.0);
  }

  Pose from_;
  Eigen::Quaterniond turned_, to_;
  Vector3 way_, axis_;
  double turn_rad_ = 0;
};

}  // namespace pons::motion
