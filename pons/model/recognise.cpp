// Which arms the closed form knows, and where their branches part.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "pons/model/closed_form.hpp"

namespace pons::model {
namespace {

constexpr double kSame = 1e-5;      // rad, or a share of the arm's size: what counts as parallel, or as meeting
constexpr double kDistinct = 1e-3;  // the same units: what must be more than this, or the arm is all but singular

bool parallel(const Vector3& a, const Vector3& b) { return a.cross(b).norm() < kSame; }

struct Feet {
  Vector3 on_first, on_second;
};

// The ends of the common perpendicular of two lines; of parallel ones, the one through the first's point.
Feet common_perpendicular(const Vector3& point, const Vector3& axis, const Vector3& other, const Vector3& other_axis) {
  const Vector3 between = other - point;
  if (parallel(axis, other_axis)) return {point, other - axis.dot(between) * axis};
  const double cosine = axis.dot(other_axis), along = axis.dot(between), other_along = other_axis.dot(between);
  const double square = 1 - cosine * cosine;
  return {point + (along - cosine * other_along) / square * axis,
          other + (cosine * along - other_along) / square * other_axis};
}

double distance_to_line(const Vector3& from, const Vector3& point, const Vector3& axis) {
  return axis.cross(from - point).norm();
}

}  // namespace

std::optional<ClosedForm> ClosedForm::recognise(const Chain& chain) {
  if (chain.axes() != 6) return std::nullopt;
  for (Eigen::Index axis = 0; axis < 6; ++axis)
    if (!chain.joint(axis).revolute) return std::nullopt;
  ClosedForm form;
  if (!form.set_up(chain) || !form.well_formed()) return std::nullopt;
  return form;
}

bool ClosedForm::set_up(const Chain& chain) {
  std::array<Vector3, 6> point;
  for (std::size_t i = 0; i < 6; ++i) {
    const Joint& joint = chain.joint(static_cast<Eigen::Index>(i));
    h_[i] = joint.axis;
    point[i] = joint.point;
    sign_[i] = 1;
  }
  size_m_ = 0;
  for (std::size_t i = 1; i < 6; ++i) size_m_ += (point[i] - point[i - 1]).norm();
  tiny_m_ = 1e-9 * size_m_;

  const auto align = [&](std::size_t i) {
    sign_[i] = std::copysign(1.0, h_[1].dot(h_[i]));
    h_[i] = h_[1];
  };
  planar_ = parallel(h_[1], h_[2]);
  const bool three_parallel = planar_ && parallel(h_[1], h_[3]);
  if (planar_) align(2);
  const Feet shoulder = common_perpendicular(point[0], h_[0], point[1], h_[1]);
  point[0] = shoulder.on_first;
  point[1] = shoulder.on_second;
  const Feet wrist = common_perpendicular(point[4], h_[4], point[5], h_[5]);
  five_meets_six_ = (wrist.on_first - wrist.on_second).norm() < kSame * size_m_;
  point[4] = wrist.on_first;
  point[5] = five_meets_six_ ? wrist.on_first : wrist.on_second;
  if (three_parallel) {
    structure_ = Structure::kThreeParallel;
    align(3);
  } else if (five_meets_six_ && distance_to_line(point[4], point[3], h_[3]) < kSame * size_m_) {
    structure_ = Structure::kSphericalWrist;
    point[3] = point[4];
  } else {
    return false;
  }
  p_[0] = point[0];
  for (std::size_t i = 1; i < 6; ++i) p_[i] = point[i] - point[i - 1];
  tip_ = chain.tip_at_zero().translation() - point[5];
  tip_turn_ = chain.tip_at_zero().linear();
  across_sixth_ = h_[5].unitOrthogonal();
  return true;
}

bool ClosedForm::well_formed() const {
  const double least_m = kDistinct * size_m_;
  const auto distinct = [&](std::size_t i, std::size_t j) { return h_[i].cross(h_[j]).norm() > kDistinct; };
  if (!distinct(3, 4) || !distinct(4, 5)) return false;
  if (planar_) return distinct(0, 1) && across(h_[1], p_[2]).norm() > least_m && across(h_[1], p_[3]).norm() > least_m;
  // Axis 3 must change what axes 1 and 2 cannot: see solve_by_third().
  const double offset = p_[1].norm();
  if (offset < tiny_m_)
    return distinct(0, 1) && across(h_[2], p_[2]).norm() > least_m && across(h_[2], p_[3]).norm() > least_m;
  return offset > least_m && distinct(1, 2) && across(h_[2], p_[3]).norm() > least_m;
}

Sides ClosedForm::sides(const AxisVector& q_robot) const {
  std::array<Angle, 6> q;
  for (std::size_t i = 0; i < 6; ++i) q[i] = Angle::of(sign_[i] * q_robot[static_cast<Eigen::Index>(i)]);
  const auto slope = [&](std::size_t axis, const Vector3& along, const Vector3& moved) {
    return along.dot(h_[axis].cross(turned(h_[axis], q[axis], moved)));
  };
  Sides sides{1, 1, slope(4, h_[3], h_[5])};
  const Vector3 fore = turned(h_[2], q[2], p_[3]), f = turned(h_[1], q[1], p_[2] + fore);
  if (planar_) {
    Vector3 reach = p_[1] + f;
    if (structure_ == Structure::kThreeParallel) {
      const Angle pitch = Angle::of(sign_[1] * q_robot[1] + sign_[2] * q_robot[2] + sign_[3] * q_robot[3]);
      const Vector3 offset = turned(h_[4], q[4], p_[5]);
      reach += turned(h_[3], pitch, p_[4] + offset);
      if (!five_meets_six_) {
        // Axes 1 and 5 share two equations, hence one determinant.
        const Vector3 sixth_axis = turned(h_[3], pitch, turned(h_[4], q[4], h_[5]));
        const auto first = [&](const Vector3& v) { return h_[1].dot(h_[0].cross(v)); };
        sides[0] = (first(reach) * sides[2] - first(sixth_axis) * slope(4, h_[3], p_[5])) / size_m_;
        sides[2] = 1;
      }
    }
    if (five_meets_six_) sides[0] = h_[1].dot(h_[0].cross(reach)) / size_m_;
    const Vector3 upper = across(h_[1], p_[2]);
    sides[1] = h_[1].dot(upper.cross(fore)) / (upper.norm() * across(h_[1], p_[3]).norm());
    return sides;
  }
  const double offset = p_[1].norm();
  if (offset < tiny_m_) {
    sides[0] = h_[0].cross(h_[1]).dot(f) / size_m_;
    sides[1] = slope(2, p_[2], p_[3]) / (size_m_ * size_m_);
  } else if (parallel(h_[0], h_[1])) {
    sides[0] = h_[1].dot(p_[1].cross(f)) / (offset * size_m_);
    sides[1] = slope(2, h_[1], p_[3]) / size_m_;
  } else {
    // The three axes' shares of the centre's speed, all at once.
    const Vector3 third_moves = turned(h_[1], q[1], h_[2].cross(fore));
    sides[1] = h_[0].cross(p_[1] + f).dot(h_[1].cross(f).cross(third_moves)) / (size_m_ * size_m_ * size_m_);
  }
  return sides;
}

}  // namespace pons::model
