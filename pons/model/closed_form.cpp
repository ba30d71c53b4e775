#include "pons/model/closed_form.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>

namespace pons::model {

struct ClosedForm::Query {
  Eigen::Matrix3d turn;              // what all six joints turn
  Vector3 centre;                    // m: where the point on axis 6 must be, from the point on axis 1
  Vector3 sixth_axis, across_sixth;  // where they must point
  std::array<double, 6> seed;
  BranchSolutions& found;
};

namespace {

constexpr double kAligned = 1e-8;  // sine below which two axes leave their common turn undetermined
constexpr double kTurn = 2 * std::numbers::pi;

// g · Rot(h, q) v = constant + cosine * cos q + sine * sin q.
struct Sum {
  double constant, cosine, sine;

  Sum(const Vector3& g, const Vector3& h, const Vector3& v)
      : constant(h.dot(g) * h.dot(v)), cosine(g.dot(v) - constant), sine(g.dot(h.cross(v))) {}
  // Where it is `wanted`.
  [[nodiscard]] Angles solve(double wanted, double tiny) const {
    return solve_sum(cosine, sine, wanted - constant, tiny);
  }
  [[nodiscard]] double at(const Angle& q) const { return constant + cosine * q.cosine + sine * q.sine; }
  [[nodiscard]] double slope(const Angle& q) const { return sine * q.cosine - cosine * q.sine; }
};

Angle angle_between(const Angle& from, const Angle& to) {
  return {to.cosine * from.cosine + to.sine * from.sine, to.sine * from.cosine - to.cosine * from.sine};
}

}  // namespace

void ClosedForm::solve(const Pose& world_from_tip, const AxisVector& seed, BranchSolutions& found) const {
  found.clear();
  Query query{.turn = world_from_tip.linear() * tip_turn_.transpose(),
              .centre = {},
              .sixth_axis = {},
              .across_sixth = {},
              .seed = {},
              .found = found};
  query.centre = world_from_tip.translation() - query.turn * tip_ - p_[0];
  query.sixth_axis = query.turn * h_[5];
  query.across_sixth = query.turn * across_sixth_;
  for (std::size_t i = 0; i < 6; ++i) query.seed[i] = sign_[i] * seed[static_cast<Eigen::Index>(i)];
  if (structure_ == Structure::kThreeParallel)
    solve_three_parallel(query);
  else
    solve_spherical_wrist(query);
}

void ClosedForm::add(Query& query, const std::array<double, 6>& q) const {
  BranchSolution solution{.q = AxisVector(6), .branch = {}};
  for (std::size_t i = 0; i < 6; ++i) solution.q[static_cast<Eigen::Index>(i)] = sign_[i] * q[i];
  query.found.add(solution);
}

// ---- What both structures need.

// Axes 2 and 3 (and 4) do not move anything along themselves, so axis 1 alone brings `centre` to the right distance.
Angles ClosedForm::planar_first(const Vector3& centre) const {
  double along = h_[1].dot(p_[1] + p_[2] + p_[3]);
  if (structure_ == Structure::kThreeParallel) along += h_[1].dot(p_[4]);
  return Sum(centre, h_[0], h_[1]).solve(along, tiny_m_);
}

// The triangle of upper arm, forearm and `reach`, which leads from axis 2 to where the forearm ends.
Angles ClosedForm::planar_third(const Vector3& reach) const {
  const Vector3 upper = across(h_[1], p_[2]), fore = across(h_[1], p_[3]);
  const double wanted = across(h_[1], reach).squaredNorm() - upper.squaredNorm() - fore.squaredNorm();
  return solve_sum(upper.dot(fore), upper.dot(h_[1].cross(fore)), 0.5 * wanted, 0);
}

Angle ClosedForm::planar_second(const Query& query, const Angle& third, const Vector3& reach) const {
  if (across(h_[1], reach).norm() < tiny_m_) return Angle::of(query.seed[1]);
  return solve_turn(h_[1], p_[2] + turned(h_[1], third, p_[3]), reach);
}

Angles ClosedForm::fifth_angles(const Vector3& sixth_axis) const {
  return Sum(h_[3], h_[4], h_[5]).solve(h_[3].dot(sixth_axis), 0);
}

// By a sine where fifth_angles() must take it from a cosine: exact where the wrist is nearly straight, too.
Angle ClosedForm::better_fifth(const Angle& fourth, const Vector3& sixth_axis) const {
  return solve_turn(h_[4], h_[5], turned_back(h_[3], fourth, sixth_axis));
}

// From the other two, so that an error they have where the wrist is nearly straight is made up for.
Angle ClosedForm::sixth_angle(const Angle& fourth, const Angle& fifth, const Vector3& across_sixth) const {
  return solve_turn(h_[5], across_sixth_, turned_back(h_[4], fifth, turned_back(h_[3], fourth, across_sixth)));
}

// ---- Three parallel axes. h_[1] = h_[2] = h_[3].

void ClosedForm::solve_three_parallel(Query& query) const {
  if (!five_meets_six_) return solve_first_and_fifth(query, query.centre);
  Angles firsts = planar_first(query.centre);
  if (firsts.any) firsts.add(Angle::of(query.seed[0]));
  for (const Angle& first : firsts) {
    const Vector3 sixth_axis = turned_back(h_[0], first, query.sixth_axis);
    const bool aligned = h_[3].cross(sixth_axis).norm() < kAligned;  // then both angles of axis 5 are one
    for (const Angle& fifth : fifth_angles(sixth_axis)) {
      solve_pitch(query, first, fifth, query.centre);
      if (aligned) break;
    }
  }
}

// Two equations, along the parallel axes, for axes 1 and 5. Both are linear in cosine and sine of axis 5: solved for
// those and squared, a quartic for axis 1 remains.
void ClosedForm::solve_first_and_fifth(Query& query, const Vector3& centre) const {
  const Vector3& h = h_[1];
  const Sum place(centre, h_[0], h), point(query.sixth_axis, h_[0], h);
  const Sum offset(h, h_[4], p_[5]), axis(h, h_[4], h_[5]);
  const double along = h.dot(p_[1] + p_[2] + p_[3] + p_[4]);
  const double determinant = offset.cosine * axis.sine - offset.sine * axis.cosine;
  // offset(q5) = place(q1) - along =: r and axis(q5) = point(q1) =: s, as constant, cosine, sine of q1.
  const std::array r{place.constant - along - offset.constant, place.cosine, place.sine};
  const std::array s{point.constant - axis.constant, point.cosine, point.sine};
  std::array<double, 3> cosine{}, sine{};
  for (std::size_t i = 0; i < 3; ++i) {
    cosine[i] = (axis.sine * r[i] - offset.sine * s[i]) / determinant;
    sine[i] = (offset.cosine * s[i] - axis.cosine * r[i]) / determinant;
  }
  const auto product = [&](std::size_t i, std::size_t j) { return cosine[i] * cosine[j] + sine[i] * sine[j]; };
  const Angles firsts = solve_quartic(product(1, 1), 2 * product(1, 2), product(2, 2), 2 * product(0, 1),
                                      2 * product(0, 2), product(0, 0) - 1);
  for (const Angle& first : firsts) {
    const double c = cosine[0] + cosine[1] * first.cosine + cosine[2] * first.sine;
    const double d = sine[0] + sine[1] * first.cosine + sine[2] * first.sine;
    const double length = std::hypot(c, d);
    if (length > 0) solve_pitch(query, first, {c / length, d / length}, centre);
  }
}

void ClosedForm::solve_pitch(Query& query, const Angle& first, const Angle& fifth, const Vector3& centre) const {
  const Vector3 reach = turned_back(h_[0], first, centre) - p_[1];
  const Vector3 sixth_axis = turned_back(h_[0], first, query.sixth_axis);
  if (h_[3].cross(sixth_axis).norm() < kAligned) return solve_free_pitch(query, first, fifth, reach);
  const Angle pitch = solve_turn(h_[3], turned(h_[4], fifth, h_[5]), sixth_axis);
  solve_planar_arm(query, first, pitch, fifth, reach);
}

// Axis 6 along the parallel ones: what it turns, they may. Shared with the seed's pitch first, then the ends of what
// the arm reaches.
void ClosedForm::solve_free_pitch(Query& query, const Angle& first, const Angle& fifth, const Vector3& reach) const {
  const double pitch_rad = query.seed[1] + query.seed[2] + query.seed[3];
  const Vector3 across_sixth = turned_back(h_[0], first, query.across_sixth);
  const double sixth_rad = sixth_angle(Angle::of(pitch_rad), fifth, across_sixth).rad();
  const double too_far = std::remainder(sixth_rad - query.seed[5], kTurn);
  const double direction = std::copysign(1.0, h_[3].dot(turned_back(h_[0], first, query.sixth_axis)));
  bool solved = false;
  for (const double share : {0.5, 1.0, 0.0})
    solved |= solve_planar_arm(query, first, Angle::of(pitch_rad + direction * share * too_far), fifth, reach);
  if (solved) return;
  const Vector3 from = across(h_[1], reach), wrist = across(h_[1], p_[4] + turned(h_[4], fifth, p_[5]));
  const double upper = across(h_[1], p_[2]).norm(), fore = across(h_[1], p_[3]).norm();
  for (const double length : {upper + fore, std::abs(upper - fore)}) {
    const double wanted = 0.5 * (from.squaredNorm() + wrist.squaredNorm() - length * length);
    for (const Angle& pitch : solve_sum(from.dot(wrist), from.dot(h_[1].cross(wrist)), wanted, 0))
      solve_planar_arm(query, first, pitch, fifth, reach);
  }
}

bool ClosedForm::solve_planar_arm(Query& query, const Angle& first, const Angle& pitch, Angle fifth,
                                  const Vector3& reach) const {
  const Vector3 sixth_axis = turned_back(h_[0], first, query.sixth_axis);
  if (five_meets_six_) fifth = better_fifth(pitch, sixth_axis);
  const Angle sixth = sixth_angle(pitch, fifth, turned_back(h_[0], first, query.across_sixth));
  const Vector3 fore_end = reach - turned(h_[3], pitch, p_[4] + turned(h_[4], fifth, p_[5]));
  const Angles thirds = planar_third(fore_end);
  const double q1 = first.rad(), q5 = fifth.rad(), q6 = sixth.rad();
  for (const Angle& third : thirds) {
    const Angle second = planar_second(query, third, fore_end);
    const Angle fourth = angle_between(third, angle_between(second, pitch));
    add(query, {q1, second.rad(), third.rad(), fourth.rad(), q5, q6});
  }
  return thirds.count > 0;
}

// ---- A spherical wrist. p_[4] = p_[5] = 0.

void ClosedForm::solve_spherical_wrist(Query& query) const {
  if (!planar_) return solve_by_third(query, query.centre);
  Angles firsts = planar_first(query.centre);
  if (firsts.any) firsts.add(Angle::of(query.seed[0]));
  for (const Angle& first : firsts) {
    const Vector3 reach = turned_back(h_[0], first, query.centre) - p_[1];
    for (const Angle& third : planar_third(reach)) solve_wrist(query, first, planar_second(query, third, reach), third);
  }
}

// With f(q3) the way from axis 2 to the wrist before axis 2 turns it, and F = |f|², G = h2·f: what axis 1 leaves alone
// (the centre's distance from its point, and its height along it) gives the parts of the turned f along p12 (u) and
// along what of h1 is across h2 (v); u² + v² = F - G² is the equation for axis 3 (Pieper 1968).
void ClosedForm::solve_by_third(Query& query, const Vector3& centre) const {
  const double offset = p_[1].norm(), skew = across(h_[1], h_[0]).norm(), cosine = h_[0].dot(h_[1]);
  const Sum product(p_[2], h_[2], p_[3]), along(h_[1], h_[2], p_[3]);
  const double lengths = p_[2].squaredNorm() + p_[3].squaredNorm(), height = h_[0].dot(centre);
  const double distance = centre.squaredNorm() - offset * offset;
  if (offset < tiny_m_) {
    for (const Angle& third : product.solve(0.5 * (distance - lengths), 0)) solve_second(query, centre, third);
    return;
  }
  if (skew < kAligned) {
    for (const Angle& third : along.solve(height * cosine - h_[1].dot(p_[2]), 0)) solve_second(query, centre, third);
    return;
  }
  // Each as constant, cosine and sine of q3, over the arm's size.
  using Row = std::array<double, 3>;
  const double scale = 1 / size_m_;
  const Row f{lengths + 2 * product.constant, 2 * product.cosine, 2 * product.sine};
  const Row g{h_[1].dot(p_[2]) + along.constant, along.cosine, along.sine};
  const Row u{0.5 * (distance - f[0]) / offset, -0.5 * f[1] / offset, -0.5 * f[2] / offset};
  const Row v{(height - cosine * g[0]) / skew, -cosine * g[1] / skew, -cosine * g[2] / skew};
  const auto square = [&](std::size_t i, std::size_t j) {
    return (u[i] * u[j] + v[i] * v[j] + g[i] * g[j]) * scale * scale;
  };
  const double s = scale * scale;
  const Angles thirds = solve_quartic(square(1, 1), 2 * square(1, 2), square(2, 2), 2 * square(0, 1) - f[1] * s,
                                      2 * square(0, 2) - f[2] * s, square(0, 0) - f[0] * s);
  for (const Angle& third : thirds) solve_second(query, centre, third);
}

void ClosedForm::solve_second(Query& query, const Vector3& centre, const Angle& third) const {
  const Vector3 f = p_[2] + turned(h_[2], third, p_[3]);
  const double offset = p_[1].norm(), along = h_[1].dot(f), radius = across(h_[1], f).norm();
  const Vector3 skew = across(h_[1], h_[0]);
  const bool meets = offset < tiny_m_, parallel = skew.norm() < kAligned;
  const Vector3 v_axis = parallel ? h_[1].cross(p_[1]).normalized() : skew.normalized();
  const Vector3 u_axis = meets ? h_[1].cross(v_axis) : p_[1] / offset;
  double u = 0, v = 0;
  if (!meets) u = 0.5 * (centre.squaredNorm() - offset * offset - f.squaredNorm()) / offset;
  if (!parallel) v = (h_[0].dot(centre) - h_[0].dot(h_[1]) * along) / skew.norm();
  // What the equations do not tell has two signs.
  const double known = meets ? v : u;
  const bool both = meets || parallel;
  if (both && std::abs(known) > radius + tiny_m_) return;
  const double other = std::sqrt(std::max(0.0, (radius - known) * (radius + known)));
  for (const double sign : {1.0, -1.0}) {
    if (meets) u = sign * other;
    if (parallel) v = sign * other;
    const Vector3 wanted = u * u_axis + v * v_axis;
    const Angle second = radius < tiny_m_ ? Angle::of(query.seed[1]) : solve_turn(h_[1], f, wanted);
    const Vector3 arm = p_[1] + turned(h_[1], second, f);
    const bool over_first = across(h_[0], centre).norm() < tiny_m_;
    solve_wrist(query, over_first ? Angle::of(query.seed[0]) : solve_turn(h_[0], arm, centre), second, third);
    if (!both || other < tiny_m_) return;
  }
}

void ClosedForm::solve_wrist(Query& query, const Angle& first, const Angle& second, const Angle& third) const {
  const auto before_wrist = [&](const Vector3& v) {
    return turned_back(h_[2], third, turned_back(h_[1], second, turned_back(h_[0], first, v)));
  };
  const Vector3 sixth_axis = before_wrist(query.sixth_axis), across_sixth = before_wrist(query.across_sixth);
  const double q1 = first.rad(), q2 = second.rad(), q3 = third.rad();
  const auto add_with = [&](const Angle& fourth) {
    const Angle fifth = better_fifth(fourth, sixth_axis);
    add(query, {q1, q2, q3, fourth.rad(), fifth.rad(), sixth_angle(fourth, fifth, across_sixth).rad()});
  };
  const Angles fifths = fifth_angles(sixth_axis);
  if (h_[3].cross(sixth_axis).norm() >= kAligned) {
    for (const Angle& fifth : fifths) add_with(solve_turn(h_[3], turned(h_[4], fifth, h_[5]), sixth_axis));
  } else if (fifths.count > 0) {
    // Axis 6 along axis 4: what they turn together is given, how they share it is not.
    const double sixth_rad = sixth_angle(Angle::of(query.seed[3]), fifths.at[0], across_sixth).rad();
    const double too_far = std::copysign(1.0, h_[3].dot(sixth_axis)) * std::remainder(sixth_rad - query.seed[5], kTurn);
    for (const double share : {0.5, 1.0, 0.0}) add_with(Angle::of(query.seed[3] + share * too_far));
  }
}

}  // namespace pons::model
