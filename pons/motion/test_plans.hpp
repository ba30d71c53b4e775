// For tests: plans as MoveIt sends them. Its default, TimeOptimalTrajectoryGeneration (Kunz and Stilman 2012), goes
// along straight lines in joint space and arcs between them, as quickly as speeds and accelerations may be. It knows no
// jerk, so accelerations step; and it tells positions and speeds each 0.1 s, and at the end, however soon that comes
// then.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/motion/timed.hpp"

namespace pons::motion {

class SampledPlan {
 public:
  static constexpr double kEach_s = 0.1;
  static constexpr double kRadius = 0.1;  // of an arc, rad

  // From rest at the first corner to rest at the last one.
  SampledPlan(const std::vector<AxisVector>& corners, const AxisVector& speeds, const AxisVector& accelerations) {
    AxisVector from = corners.front();
    for (std::size_t k = 1; k < corners.size(); ++k) {
      const AxisVector along = (corners[k] - from).normalized();
      if (k + 1 == corners.size()) {
        add_line(from, corners[k], speeds, accelerations);
        break;
      }
      const AxisVector next = (corners[k + 1] - corners[k]).normalized();
      const double turn = std::acos(std::clamp(along.dot(next), -1.0, 1.0));
      const AxisVector begin = corners[k] - kRadius * std::tan(turn / 2) * along;
      add_line(from, begin, speeds, accelerations);
      const double speed = std::min(speeds.minCoeff(), std::sqrt(kRadius * accelerations.minCoeff()));
      pieces_.push_back({.from = begin,
                         .along = along,
                         .inward = (next - along.dot(next) * along).normalized(),
                         .length = kRadius * turn,
                         .fastest = speed,
                         .is_arc = true});
      from = corners[k] + kRadius * std::tan(turn / 2) * next;
    }
    choose_speeds();
  }

  [[nodiscard]] double duration_s() const {
    double all_s = 0;
    for (const Piece& piece : pieces_) all_s += piece.duration_s();
    return all_s;
  }
  [[nodiscard]] TimedPoint at(double time_s) const {
    double t = time_s;
    auto piece = pieces_.begin();
    for (; piece + 1 != pieces_.end() && t > piece->duration_s(); ++piece) t -= piece->duration_s();
    TimedPoint point = piece->at(std::min(t, piece->duration_s()));
    point.time_s = time_s;
    return point;
  }
  // The first is at 0.
  [[nodiscard]] std::vector<TimedPoint> points() const {
    std::vector<TimedPoint> sampled;
    const int whole = static_cast<int>(std::ceil(duration_s() / kEach_s - 1e-6));
    for (int i = 0; i < whole; ++i) sampled.push_back(at(i * kEach_s));
    sampled.push_back(at(duration_s()));
    sampled.back().speed->setZero();
    return sampled;
  }

 private:
  // Its speed rises, stays, and falls.
  struct Piece {
    AxisVector from, along, inward = {};
    double length = 0;
    double fastest = 0, quickest = 0;       // along it, per s and s²
    double begins = 0, peak = 0, ends = 0;  // speeds
    bool is_arc = false;

    [[nodiscard]] double rises_s() const { return quickest > 0 ? (peak - begins) / quickest : 0; }
    [[nodiscard]] double falls_s() const { return quickest > 0 ? (peak - ends) / quickest : 0; }
    [[nodiscard]] double stays_s() const {
      return (length - 0.5 * (begins + peak) * rises_s() - 0.5 * (peak + ends) * falls_s()) / peak;
    }
    [[nodiscard]] double duration_s() const { return rises_s() + stays_s() + falls_s(); }
    [[nodiscard]] TimedPoint at(double t) const {
      const double rising = std::min(t, rises_s()), falling = std::max(t - rises_s() - stays_s(), 0.0);
      const double speed = begins + quickest * (rising - falling);
      const double gone =
          begins * rising + 0.5 * quickest * rising * rising + peak * (t - rising) - 0.5 * quickest * falling * falling;
      if (!is_arc) return {0, from + gone * along, speed * along};
      const double sine = std::sin(gone / kRadius), cosine = std::cos(gone / kRadius);
      return {0, from + kRadius * (sine * along + (1 - cosine) * inward), speed * (cosine * along + sine * inward)};
    }
  };

  void add_line(const AxisVector& from, const AxisVector& to, const AxisVector& speeds,
                const AxisVector& accelerations) {
    const AxisVector along = (to - from).normalized();
    pieces_.push_back({.from = from,
                       .along = along,
                       .length = (to - from).norm(),
                       .fastest = 1 / along.cwiseAbs().cwiseQuotient(speeds).maxCoeff(),
                       .quickest = 1 / along.cwiseAbs().cwiseQuotient(accelerations).maxCoeff()});
  }
  // An arc is passed at one speed, which the lines beside it begin and end with.
  void choose_speeds() {
    for (std::size_t k = 0; k < pieces_.size(); ++k) {
      Piece& piece = pieces_[k];
      piece.begins = piece.is_arc ? piece.fastest : k == 0 ? 0 : pieces_[k - 1].fastest;
      piece.ends = piece.is_arc ? piece.fastest : k + 1 == pieces_.size() ? 0 : pieces_[k + 1].fastest;
      const double ends_squared = 0.5 * (piece.begins * piece.begins + piece.ends * piece.ends);
      piece.peak = std::min(piece.fastest, std::sqrt(ends_squared + piece.quickest * piece.length));
    }
  }

  std::vector<Piece> pieces_;
};

// So many sides of the parallelogram that two ways from a corner span, round and round.
[[nodiscard]] inline std::vector<AxisVector> laps(const AxisVector& from, const AxisVector& one,
                                                  const AxisVector& other, int sides) {
  std::vector<AxisVector> corners{from};
  for (int side = 0; side < sides; ++side) {
    const AxisVector& along = side % 2 == 0 ? one : other;
    corners.emplace_back(corners.back() + (side % 4 < 2 ? 1.0 : -1.0) * along);
  }
  return corners;
}

// The same corners, drawn towards the first one until the last interval of its plan is so long.
[[nodiscard]] inline SampledPlan plan_that_ends_after(double last_s, const std::vector<AxisVector>& corners,
                                                      const AxisVector& speeds, const AxisVector& accelerations) {
  const auto drawn = [&](double share) {
    std::vector<AxisVector> nearer = corners;
    for (AxisVector& corner : nearer) corner = corners.front() + share * (corner - corners.front());
    return SampledPlan(nearer, speeds, accelerations);
  };
  const double whole = std::floor(drawn(1).duration_s() / SampledPlan::kEach_s) - 1;
  double too_near = 0.2, too_far = 1;
  for (int round = 0; round < 60; ++round) {
    const double share = 0.5 * (too_near + too_far);
    const bool short_of_it = drawn(share).duration_s() < whole * SampledPlan::kEach_s + last_s;
    (short_of_it ? too_near : too_far) = share;
  }
  return drawn(too_far);
}

}  // namespace pons::motion
