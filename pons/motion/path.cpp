#include "pons/motion/path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include "pons/core/random.hpp"

namespace pons::motion {
namespace {

constexpr double kStep_rad = 0.5;                 // that a tree grows by at most
constexpr double kBeyond_rad = std::numbers::pi;  // both ends, where samples are drawn

class Tree {
 public:
  explicit Tree(const AxisVector& root) : nodes_{{root, 0}} {}

  [[nodiscard]] std::size_t nearest(const AxisVector& q) const {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      const double apart = (nodes_[i].q - q).squaredNorm();
      if (apart < least) least = apart, best = i;
    }
    return best;
  }

  // One step from the nearest node towards q, where that is free: what it reached.
  std::optional<std::size_t> extend(const AxisVector& q, const FreeSpace& space) { return step(nearest(q), q, space); }

  // As many steps as are free.
  std::optional<std::size_t> connect(const AxisVector& q, const FreeSpace& space) {
    auto reached = extend(q, space);
    while (reached && nodes_[*reached].q != q) reached = step(*reached, q, space);
    return reached;
  }

  [[nodiscard]] const AxisVector& at(std::size_t node) const { return nodes_[node].q; }
  // From `node` to the root.
  [[nodiscard]] std::vector<AxisVector> way_back(std::size_t node) const {
    std::vector<AxisVector> way{nodes_[node].q};
    while (node != 0) way.push_back(nodes_[node = nodes_[node].parent].q);
    return way;
  }

 private:
  struct Node {
    AxisVector q;
    std::size_t parent;
  };

  std::optional<std::size_t> step(std::size_t from, const AxisVector& q, const FreeSpace& space) {
    const AxisVector way = q - nodes_[from].q;
    const double length = way.norm();
    const AxisVector to = length <= kStep_rad ? q : AxisVector(nodes_[from].q + kStep_rad / length * way);
    if (length == 0 || !space.connects(nodes_[from].q, to)) return {};
    nodes_.push_back({to, from});
    return nodes_.size() - 1;
  }

  std::vector<Node> nodes_;
};

struct Range {
  AxisVector low, high;
};

Range sampled(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits) {
  return {(start.cwiseMin(goal).array() - kBeyond_rad).matrix().cwiseMax(limits.position_min),
          (start.cwiseMax(goal).array() + kBeyond_rad).matrix().cwiseMin(limits.position_max)};
}

AxisVector draw(Random& random, const Range& range) {
  AxisVector q(range.low.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) q[i] = random.uniform(range.low[i], range.high[i]);
  return q;
}

// Where a walk of `way` (rad) along the path leads, and on which of its lines.
std::pair<AxisVector, std::size_t> walk(const std::vector<AxisVector>& points, double way) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double length = (points[i + 1] - points[i]).norm();
    if (way <= length && length > 0) return {points[i] + way / length * (points[i + 1] - points[i]), i};
    way -= length;
  }
  return {points.back(), points.size() - 2};
}

void shorten(std::vector<AxisVector>& points, const FreeSpace& space, int tries, Random& random) {
  for (int i = 0; i < tries && points.size() > 2; ++i) {
    const double length = length_rad(points), a = length * random.uniform(), b = length * random.uniform();
    const auto [first, first_line] = walk(points, std::min(a, b));
    const auto [last, last_line] = walk(points, std::max(a, b));
    if (first_line == last_line || !space.connects(first, last)) continue;
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(first_line) + 1;
    const auto at = points.erase(begin, points.begin() + static_cast<std::ptrdiff_t>(last_line) + 1);
    points.insert(at, {first, last});
  }
  for (std::size_t i = 1; i + 1 < points.size();) {
    if (space.connects(points[i - 1], points[i + 1])) {
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(i));
    } else {
      ++i;
    }
  }
}

Expected<void> check_end(const AxisVector& q, std::string_view name, const AxisLimits& limits, const FreeSpace& space) {
  if (q.size() != limits.position_min.size() || !q.allFinite()) {
    return fail("not one finite value an axis", std::string(name), "give one value an axis");
  }
  const bool inside =
      (q.array() >= limits.position_min.array()).all() && (q.array() <= limits.position_max.array()).all();
  if (!inside) return fail("is outside the position limits", std::string(name), "plan within the robot's limits");
  if (!space.holds(q))
    return fail("something is in touch there", std::string(name), "begin and end clear of everything");
  return {};
}

}  // namespace

double length_rad(std::span<const AxisVector> points) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) length += (points[i + 1] - points[i]).norm();
  return length;
}

Expected<Path> find_path(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits,
                         const FreeSpace& space, const PathSearch& search) {
  auto ok = check_end(start, "start", limits, space);
  if (ok) ok = check_end(goal, "goal", limits, space);
  if (!ok) return std::unexpected(ok.error());
  if (space.connects(start, goal)) return Path{{start, goal}, 0, (goal - start).norm()};

  Random random(search.seed);
  const Range range = sampled(start, goal, limits);
  Tree from_start(start), from_goal(goal);
  Tree *growing = &from_start, *other = &from_goal;
  for (int i = 1; i <= search.iterations; ++i, std::swap(growing, other)) {
    const auto grown = growing->extend(draw(random, range), space);
    if (!grown) continue;
    const AxisVector& meeting = growing->at(*grown);
    const auto met = other->connect(meeting, space);
    if (!met) continue;
    const bool forward = growing == &from_start;
    std::vector<AxisVector> points = from_start.way_back(forward ? *grown : *met);
    std::ranges::reverse(points);
    const std::vector<AxisVector> rest = from_goal.way_back(forward ? *met : *grown);
    points.insert(points.end(), rest.begin() + 1, rest.end());  // both hold where they met
    Path path{{}, i, length_rad(points)};
    shorten(points, space, search.shortcuts, random);
    path.points = std::move(points);
    return path;
  }
  return fail(fmt::format("no path found with {} samples", search.iterations), "path",
              "clear the space, choose another goal, or allow more samples");
}

}  // namespace pons::motion
