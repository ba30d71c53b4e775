#include "pons/motion/line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pons/motion/assemble.hpp"
#include "pons/motion/pace.hpp"
#include "pons/motion/straight.hpp"
#include "pons/motion/track.hpp"

namespace pons::motion {
namespace {

constexpr double kNear_rad = 0.02;       // between neighbours of the table, each axis
constexpr double kJump = 1e-6;           // share of the line within which an axis may not turn farther than that
constexpr double kNodesApart_s = 0.001;  // of the path that is paced, in time at full speed
constexpr Eigen::Index kFewestNodes = 200, kMostColumns = 6000;
constexpr Eigen::Index kSmooth = 4;  // nodes to either side over which their spacing is evened out, twice
constexpr double kKnot_s = 0.010;
constexpr double kCoarsest_s = 0.02;   // between knots: coarser ones lose the line's bends
constexpr Eigen::Index kHold = 4;      // knots at the end, so that it ends at rest exactly
constexpr double kMovingPieces = 236;  // and these are what the control loop holds at once
constexpr double kLongest_s = kCoarsest_s * kMovingPieces;
constexpr double kStretch = 1.01;  // tried next where the fitted motion is beyond a limit
constexpr int kStretches = 70;     // to twice as long
constexpr double kTrusted = 0.8;   // of the steps that its excess asks for
constexpr double kNothing = 1e-9;  // m and rad: no way, no turn

// Poses that may still be asked for. Counted, never timed: the same line is planned or refused on any computer.
class Budget {
 public:
  explicit Budget(int most) : most_(most) {}
  [[nodiscard]] bool take() { return ++taken_ <= most_; }
  [[nodiscard]] bool spent() const { return taken_ > most_; }
  [[nodiscard]] int taken() const { return taken_; }
  [[nodiscard]] std::unexpected<Error> error() const {
    return fail(fmt::format("takes more than {} poses to plan: it passes close to a singularity, or is long", most_),
                "line", "pass farther beside the singularity, or go in parts");
  }

 private:
  int most_, taken_ = 0;
};

// Joint angles for a pose close to one whose angles are known.
class Tracker {
 public:
  Tracker(const model::RobotModel& model, Budget& budget) : model_(model), budget_(budget) {}

  [[nodiscard]] bool spent() const { return budget_.spent(); }
  [[nodiscard]] Expected<AxisVector> operator()(const Pose& pose, const AxisVector& near) const {
    if (!budget_.take()) return budget_.error();
    return angles_near(model_, pose, near);
  }

 private:
  const model::RobotModel& model_;
  Budget& budget_;
};

struct Node {
  double share;
  AxisVector q;
};

std::string where(const Straight& line, double share) {
  const Vector3 p = line.at(share).translation();
  return fmt::format("after {:.1f} % of the line, at ({:.3f}, {:.3f}, {:.3f}) m", 100 * share, p.x(), p.y(), p.z());
}

Error beyond(const Straight& line, double share) {
  return {"leaves the arm's reach or an axis' position limits " + where(line, share), "line",
          "end it before, or choose another start"};
}

// Joint angles along the line, so close together that each follows from the one before.
class Table {
 public:
  Table(const model::RobotModel& model, const Straight& line, Budget& budget)
      : model_(model), track_(model, budget), line_(line) {}

  Expected<std::vector<Node>> fill(const AxisVector& start) const {
    std::vector<Node> nodes{{0, start}};
    double step = 1.0 / 64;
    while (nodes.back().share < 1) {
      const Node& last = nodes.back();
      const double share = std::min(1.0, last.share + step);
      auto q = track_(line_.at(share), last.q);
      if (track_.spent()) return std::unexpected(q.error());
      const double turned = q ? (*q - last.q).cwiseAbs().maxCoeff() : 1;
      if (turned > kNear_rad) {
        if (step *= 0.5; step < kJump) return std::unexpected(stuck(last, q));
        continue;
      }
      nodes.push_back({share, std::move(*q)});
      if (turned < 0.4 * kNear_rad) step = std::min(2 * step, 1.0 / 64);
    }
    return nodes;
  }

 private:
  // Why it cannot go on from there.
  [[nodiscard]] Error stuck(const Node& last, const Expected<AxisVector>& q) const {
    const double next = std::min(1.0, last.share + 10 * kJump);
    const auto elsewhere = model_.inverse(line_.at(next), last.q, model::Among::kAllBranches);
    if (!q && !elsewhere) return beyond(line_, last.share);
    Eigen::Index axis = 0;
    const AxisVector& there = q ? *q : *elsewhere;
    (there - last.q).cwiseAbs().maxCoeff(&axis);
    return {
        fmt::format("runs through a singularity {}: axis {} would have to jump", where(line_, last.share), axis + 1),
        "line", "pass beside it, or go by joints"};
  }

  const model::RobotModel& model_;
  Tracker track_;
  const Straight& line_;
};

// Every coordinate's speed limit as a length of time: of joints, and of the tip, along the line.
struct Rates {
  AxisLimits joints;
  TipLimits tip;
  double length_m, turn_rad;

  // The time that speed limits ask for between two nodes, by each coordinate.
  [[nodiscard]] Eigen::VectorXd times(const Node& a, const Node& b) const {
    Eigen::VectorXd times(a.q.size() + 2);
    times << (b.q - a.q).cwiseAbs().cwiseQuotient(joints.speed_rad_s), (b.share - a.share) * length_m / tip.speed_m_s,
        (b.share - a.share) * turn_rad / tip.turn_rad_s;
    return times;
  }
};

// Shares of the line at equal distances of time at full speed, evened out: pacing wants a smooth path.
std::vector<double> spread(const std::vector<Node>& nodes, const Rates& rates, double& whole_s) {
  std::vector<double> at{0};
  for (std::size_t k = 1; k < nodes.size(); ++k) at.push_back(at.back() + rates.times(nodes[k - 1], nodes[k]).norm());
  whole_s = at.back();
  const Eigen::Index columns =
      std::clamp(static_cast<Eigen::Index>(whole_s / kNodesApart_s), kFewestNodes, kMostColumns);
  std::vector<double> shares;
  std::size_t node = 0;
  for (Eigen::Index k = 0; k <= columns; ++k) {
    const double wanted = whole_s * static_cast<double>(k) / static_cast<double>(columns);
    while (node + 2 < at.size() && at[node + 1] < wanted) ++node;
    const double on = std::clamp((wanted - at[node]) / (at[node + 1] - at[node]), 0.0, 1.0);
    shares.push_back(nodes[node].share + on * (nodes[node + 1].share - nodes[node].share));
  }
  for (int round = 0; round < 2; ++round) {
    std::vector<double> even = shares;
    for (Eigen::Index k = 1; k < columns; ++k) {
      const Eigen::Index reach = std::min({kSmooth, k, columns - k});
      double sum = 0;
      for (Eigen::Index i = k - reach; i <= k + reach; ++i) sum += shares[static_cast<std::size_t>(i)];
      even[static_cast<std::size_t>(k)] = sum / static_cast<double>(2 * reach + 1);
    }
    shares = std::move(even);
  }
  return shares;
}

// The path that is paced: joints, and the tip's way and turn.
Expected<SampledPath> sampled(const Tracker& track, const Straight& line, const AxisVector& start,
                              const std::vector<double>& shares, double whole_s, const Rates& rates) {
  const Eigen::Index axes = start.size(), columns = static_cast<Eigen::Index>(shares.size());
  SampledPath path{Eigen::MatrixXd(axes + 2, columns), whole_s / static_cast<double>(columns - 1), {}};
  AxisVector q = start;
  for (Eigen::Index k = 0; k < columns; ++k) {
    const double share = shares[static_cast<std::size_t>(k)];
    auto next = track(line.at(share), q);
    if (!next) return std::unexpected(track.spent() ? next.error() : beyond(line, share));
    q = *next;
    path.points.col(k) << q, share * line.length_m(), share * line.turn_rad();
  }
  for (Eigen::Index i = 0; i < axes; ++i) {
    const AxisLimits& joints = rates.joints;
    path.limits.push_back({joints.speed_rad_s[i], joints.acceleration_rad_s2[i], joints.jerk_rad_s3[i]});
  }
  const TipLimits& tip = rates.tip;
  path.limits.push_back({tip.speed_m_s, tip.acceleration_m_s2, tip.jerk_m_s3});
  path.limits.push_back({tip.turn_rad_s, tip.turn_acceleration_rad_s2, tip.turn_jerk_rad_s3});
  return path;
}

double rest_to_rest_s(double way, double speed, double acceleration, double jerk) {
  const AxisTask task{{}, way, 0, AxisBounds::symmetric(speed, acceleration, jerk)};
  return way < kNothing ? 0 : PositionPlan(task).duration_s();
}

double least_s(const std::vector<Node>& nodes, const Rates& rates) {
  double by_speed_s = 0;
  for (std::size_t k = 1; k < nodes.size(); ++k) by_speed_s += rates.times(nodes[k - 1], nodes[k]).maxCoeff();
  double least = by_speed_s;
  const TipLimits& tip = rates.tip;
  least = std::max(least, rest_to_rest_s(rates.length_m, tip.speed_m_s, tip.acceleration_m_s2, tip.jerk_m_s3));
  least = std::max(least,
                   rest_to_rest_s(rates.turn_rad, tip.turn_rad_s, tip.turn_acceleration_rad_s2, tip.turn_jerk_rad_s3));
  const AxisVector turned = (nodes.back().q - nodes.front().q).cwiseAbs();
  const AxisLimits& joints = rates.joints;
  for (Eigen::Index i = 0; i < turned.size(); ++i) {
    least = std::max(
        least, rest_to_rest_s(turned[i], joints.speed_rad_s[i], joints.acceleration_rad_s2[i], joints.jerk_rad_s3[i]));
  }
  return least;
}

// Whether the fitted motion keeps to the line, looked at between its knots too.
bool keeps_to(const Trajectory& trajectory, const Straight& line, model::RobotModel& model, Budget& budget) {
  for (const Segment& segment : trajectory) {
    if (!budget.take()) return false;
    for (const double part : {0.0, 0.25, 0.5, 0.75}) {
      const Time time = segment.start + from_s(part * to_s(segment.duration));
      if (!line.holds(model.world_from_tip(sample(trajectory, time, model.axes()).position))) return false;
    }
  }
  return true;
}

Expected<void> check(const model::RobotModel& model, const AxisVector& start, const Pose& goal,
                     const AxisLimits& limits, const TipLimits& tip) {
  if (start.size() != model.axes() || !start.allFinite() || !goal.matrix().allFinite()) {
    return fail("start or goal is not finite, or the start has another number of axes", "line", "mend them");
  }
  const AxisVector still = AxisVector::Zero(start.size());
  if (auto ok = check_start({start, still, still}, limits); !ok) return ok;
  const double rates[] = {tip.speed_m_s,  tip.acceleration_m_s2,        tip.jerk_m_s3,
                          tip.turn_rad_s, tip.turn_acceleration_rad_s2, tip.turn_jerk_rad_s3};
  if (!std::ranges::all_of(rates, [](double rate) { return rate > 0 && std::isfinite(rate); })) {
    return fail("a limit of the tip is not positive and finite", "line", "mend the tip's limits");
  }
  return {};
}

Error too_long() {
  return {fmt::format("would take more than the {:.1f} s that can be followed: it passes close to a singularity, or is "
                      "long",
                      kLongest_s),
          "line", "pass farther beside the singularity, or go in parts"};
}

// How many steps of kStretch slower a fitted motion must at least be: slower in time by s, speeds are less by s,
// accelerations by its square, jerks by its cube. Some of them less, because the slower one is fitted anew.
int steps_slower(const LimitUse& use) {
  const double excess = std::max({use.speed, std::sqrt(use.acceleration), std::cbrt(use.jerk)});
  return std::max(1, static_cast<int>(kTrusted * std::log(excess) / std::log(kStretch)));
}

// The line at its pace: the first of a few ever slower motions that keeps to it and to all limits.
class Fitting {
 public:
  Fitting(model::RobotModel& model, const Straight& line, const AxisLimits& limits, Budget& budget)
      : model_(model), line_(line), limits_(limits), budget_(budget), track_(model, budget) {}

  Expected<Trajectory> run(const AxisVector& start, Time at, const Pace& pace, const std::vector<double>& shares,
                           double step) {
    const AxisState rest{start, AxisVector::Zero(start.size()), AxisVector::Zero(start.size())};
    Expected<void> why = fail("cannot be followed to 0.1 mm", "line", "pass farther beside the singularity");
    for (int slower = 0; slower < kStretches;) {
      const double stretch = std::pow(kStretch, slower), moves_s = stretch * pace.duration_s();
      if (moves_s > kLongest_s) return std::unexpected(too_long());
      const double knot_s = std::max(kKnot_s, moves_s / kMovingPieces);
      AxisVector q = start;
      const auto follow_line = [&](double t) -> Expected<AxisVector> {
        const double column = pace.at(t / stretch) / step;
        const auto k = std::min(static_cast<std::size_t>(column), shares.size() - 2);
        auto next = track_(line_.at(cubic(shares, k, column - static_cast<double>(k))), q);
        if (next) q = *next;
        return next;
      };
      const double duration_s = knot_s * (std::ceil(moves_s / knot_s) + static_cast<double>(kHold));
      auto fitted = fit(rest, at, follow_line, duration_s, knot_s, limits_);
      const LimitUse use = fitted ? limit_use(*fitted, limits_) : LimitUse{};
      const bool within = fitted && use.worst() <= 1 + kLimitTolerance;
      if (within && keeps_to(*fitted, line_, model_, budget_)) return fitted;
      if (budget_.spent()) return budget_.error();
      if (!within) why = fitted ? check_use(*fitted, limits_) : std::unexpected(fitted.error());
      slower += fitted && !within ? steps_slower(use) : 1;
    }
    return std::unexpected(why.error());
  }

 private:
  model::RobotModel& model_;
  const Straight& line_;
  const AxisLimits& limits_;
  Budget& budget_;
  Tracker track_;
};

}  // namespace

Expected<Line> move_line(model::RobotModel& model, const AxisVector& start, Time at, const Pose& world_from_tip,
                         const AxisLimits& limits, const TipLimits& tip, int most_poses) {
  if (auto ok = check(model, start, world_from_tip, limits, tip); !ok) return std::unexpected(ok.error());
  const Straight line(model.world_from_tip(start), world_from_tip);
  if (line.length_m() < kNothing && line.turn_rad() < kNothing) {
    const AxisVector still = AxisVector::Zero(start.size());
    auto stay = move({start, still, still}, at, {start, still}, limits);
    if (!stay) return std::unexpected(stay.error());
    return Line{std::move(*stay), 0, 0};
  }
  Budget budget(most_poses);
  const auto nodes = Table(model, line, budget).fill(start);
  if (!nodes) return std::unexpected(nodes.error());
  const Rates rates{limits, tip, line.length_m(), line.turn_rad()};
  const double least = least_s(*nodes, rates);
  if (least > kLongest_s) return std::unexpected(too_long());
  double whole_s = 0;
  const std::vector<double> shares = spread(*nodes, rates, whole_s);
  const auto path = sampled(Tracker(model, budget), line, start, shares, whole_s, rates);
  if (!path) return std::unexpected(path.error());
  const auto pace = find_pace(*path, kLongest_s);
  if (!pace) return std::unexpected(too_long());
  auto trajectory = Fitting(model, line, limits, budget).run(start, at, *pace, shares, path->step);
  if (!trajectory) return std::unexpected(trajectory.error());
  return Line{std::move(*trajectory), least, budget.taken()};
}

}  // namespace pons::motion
