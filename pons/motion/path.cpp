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

struct PathFinder::Impl {
  AxisVector start, goal;
  AxisLimits limits;
  PathSearch search;
  Random random;
  Range range;
  Tree from_start, from_goal;
  bool begun = false, forward = true;  // the tree from the start grows
  int iterations = 0, shortcuts = 0;
  Path path;  // its points, once there is one

  Impl(const AxisVector& a, const AxisVector& b, const AxisLimits& bounds, const PathSearch& how)
      : start(a), goal(b), limits(bounds), search(how), random(how.seed), from_start(a), from_goal(b) {}

  // The path itself where it is straight.
  std::optional<Expected<Path>> begin(const FreeSpace& space) {
    begun = true;
    auto ok = check_end(start, "start", limits, space);
    if (ok) ok = check_end(goal, "goal", limits, space);
    if (!ok) return std::unexpected(ok.error());
    if (space.connects(start, goal)) return Path{{start, goal}, 0, (goal - start).norm()};
    range = sampled(start, goal, limits);
    return {};
  }

  void sample(const FreeSpace& space) {
    ++iterations;
    Tree& growing = forward ? from_start : from_goal;
    Tree& other = forward ? from_goal : from_start;
    const bool grows_from_start = std::exchange(forward, !forward);
    const auto grown = growing.extend(draw(random, range), space);
    if (!grown) return;
    const auto met = other.connect(growing.at(*grown), space);
    if (!met) return;
    std::vector<AxisVector> points = from_start.way_back(grows_from_start ? *grown : *met);
    std::ranges::reverse(points);
    const std::vector<AxisVector> rest = from_goal.way_back(grows_from_start ? *met : *grown);
    points.insert(points.end(), rest.begin() + 1, rest.end());  // both hold where they met
    path = {std::move(points), iterations, 0};
    path.found_rad = length_rad(path.points);
  }

  void shorten(const FreeSpace& space) {
    ++shortcuts;
    std::vector<AxisVector>& points = path.points;
    const double length = length_rad(points), a = length * random.uniform(), b = length * random.uniform();
    const auto [first, first_line] = walk(points, std::min(a, b));
    const auto [last, last_line] = walk(points, std::max(a, b));
    if (first_line == last_line || !space.connects(first, last)) return;
    const auto begin_at = points.begin() + static_cast<std::ptrdiff_t>(first_line) + 1;
    const auto at = points.erase(begin_at, points.begin() + static_cast<std::ptrdiff_t>(last_line) + 1);
    points.insert(at, {first, last});
  }

  void leave_out_corners(const FreeSpace& space) {
    std::vector<AxisVector>& points = path.points;
    for (std::size_t i = 1; i + 1 < points.size();) {
      if (space.connects(points[i - 1], points[i + 1])) {
        points.erase(points.begin() + static_cast<std::ptrdiff_t>(i));
      } else {
        ++i;
      }
    }
  }
};

PathFinder::PathFinder(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits,
                       const PathSearch& search)
    : impl_(std::make_unique<Impl>(start, goal, limits, search)) {}
PathFinder::PathFinder(PathFinder&&) noexcept = default;
PathFinder& PathFinder::operator=(PathFinder&&) noexcept = default;
PathFinder::~PathFinder() = default;

std::optional<Expected<Path>> PathFinder::advance(int steps, const FreeSpace& space) {
  Impl& state = *impl_;
  if (!state.begun) {
    if (auto ended = state.begin(space)) return ended;
  }
  for (; steps > 0; --steps) {
    if (state.path.points.empty()) {
      if (state.iterations >= state.search.iterations) {
        return fail(fmt::format("no path found with {} samples", state.search.iterations), "path",
                    "clear the space, choose another goal, or allow more samples");
      }
      state.sample(space);
    } else if (state.shortcuts < state.search.shortcuts && state.path.points.size() > 2) {
      state.shorten(space);
    } else {
      state.leave_out_corners(space);
      return std::move(state.path);
    }
  }
  return {};
}

Expected<Path> find_path(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits,
                         const FreeSpace& space, const PathSearch& search) {
  PathFinder finder(start, goal, limits, search);
  for (;;) {
    if (auto ended = finder.advance(search.iterations + search.shortcuts + 1, space)) return std::move(*ended);
  }
}

}  // namespace pons::motion
