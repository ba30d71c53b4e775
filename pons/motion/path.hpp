// A way round what is in the way: a path of straight lines in joint space, found by sampling. When, and how fast, is
// another matter: motion.hpp. Joint angles in rad. Any thread, but one at a time for one PathFinder.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"

namespace pons::motion {

// What the search may use of joint space. Both answers must depend on their arguments alone.
struct FreeSpace {
  std::function<bool(const AxisVector& q)> holds;                          // the posture
  std::function<bool(const AxisVector& a, const AxisVector& b)> connects;  // the straight line, both ends included
};

// The same seed gives the same path: it ends by counts, never by the clock.
struct PathSearch {
  std::uint64_t seed = 1;
  int iterations = 1000;  // samples at most
  int shortcuts = 60;     // tries
};

struct Path {
  std::vector<AxisVector> points;  // start, corners, goal; each line between them is free
  int iterations = 0;              // samples that it took; 0 where the straight line was free
  double found_rad = 0;            // its length as it was found, before it was shortened
};

// The length of the lines between `points`, by the Euclidean norm of joint angles, rad.
[[nodiscard]] double length_rad(std::span<const AxisVector> points);

// RRT-Connect (Kuffner and LaValle, "RRT-Connect: an efficient approach to single-query path planning", 2000): a tree
// from either end, in turn one grows a step towards a sample and the other as far as it can towards what that gave.
// Then shortcuts between random points of the path (Geraerts and Overmars 2007, section 3.2), and corners left out that
// are not needed. Samples lie within the position limits and at most half a turn beyond both ends. Probabilistically
// complete: a path that exists and has room is found if `iterations` are enough.
// Errors: start or goal outside the position limits, or not free; no path in so many iterations.
[[nodiscard]] Expected<Path> find_path(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits,
                                       const FreeSpace& space, const PathSearch& search);

// The same search, and the same path, for who has only a little time now and then.
class PathFinder {
 public:
  PathFinder(const AxisVector& start, const AxisVector& goal, const AxisLimits& limits, const PathSearch& search);
  PathFinder(PathFinder&&) noexcept;
  PathFinder& operator=(PathFinder&&) noexcept;
  ~PathFinder();

  // Goes on for so many samples, or as many tries to shorten. The path or the error once it has ended; then it is done.
  [[nodiscard]] std::optional<Expected<Path>> advance(int steps, const FreeSpace& space);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::motion
