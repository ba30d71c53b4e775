// The equations that closed-form inverse kinematics comes down to: those of one or two turns about known axes, after
// Paden (1986), Kahan and Elias and Wen, "IK-Geo" (2022). Pure functions of fixed size.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "pons/model/chain.hpp"

namespace pons::model {

// An angle by its cosine and sine: most of them are applied more often than they are read.
struct Angle {
  double cosine = 1, sine = 0;

  static Angle of(double rad) { return {std::cos(rad), std::sin(rad)}; }
  [[nodiscard]] double rad() const { return std::atan2(sine, cosine); }
};

[[nodiscard]] inline Vector3 turned(const Vector3& axis, const Angle& angle, const Vector3& v) {
  return turned(axis, angle.cosine, angle.sine, v);
}
[[nodiscard]] inline Vector3 turned_back(const Vector3& axis, const Angle& angle, const Vector3& v) {
  return turned(axis, angle.cosine, -angle.sine, v);
}

// Up to four angles, as many as an equation of the kinds below can have; none where it has no real solution.
struct Angles {
  std::array<Angle, 4> at{};
  std::size_t count = 0;
  bool any = false;  // every angle solves it; `at` then holds none

  void add(const Angle& angle) {
    if (count < at.size()) at[count++] = angle;
  }
  [[nodiscard]] const Angle* begin() const { return at.data(); }
  [[nodiscard]] const Angle* end() const { return at.data() + count; }
};

// x cos q + y sin q = z: two solutions, one where they touch, `any` where |(x, y)| <= tiny and |z| <= tiny. A z beyond
// |(x, y)| by rounding only (a share of 1e-9) counts as touching. Subproblems 3 and 4 of the papers are of this form.
[[nodiscard]] Angles solve_sum(double x, double y, double z, double tiny);

// a cos² q + b cos q sin q + c sin² q + d cos q + e sin q + f = 0, scaled so that its terms are of about one size: what
// subproblems 5 and 6 (two coupled turns, Pieper 1968) become. Roots that all but touch (1e-12) count as one that does.
[[nodiscard]] Angles solve_quartic(double a, double b, double c, double d, double e, double f);

// Subproblem 1: the turn about the unit `axis` that brings `from` nearest to `to`. Where one of them has no part across
// the axis any turn does: zero then, so ask across() first where that can be.
[[nodiscard]] Angle solve_turn(const Vector3& axis, const Vector3& from, const Vector3& to);

// The part of v across the unit axis.
[[nodiscard]] inline Vector3 across(const Vector3& axis, const Vector3& v) { return v - axis.dot(v) * axis; }

}  // namespace pons::model
