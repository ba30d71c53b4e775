// Inside motion: how fast a given path may be run through, when each of its coordinates has limits of its own.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

namespace pons::motion {

// Between values[k] and values[k + 1], `share` of the way, by cubic convolution (Keys 1981): smooth to the first
// derivative.
[[nodiscard]] double cubic(const std::vector<double>& values, std::size_t k, double share);

// Rates of one coordinate, symmetric and positive.
struct RateLimits {
  double speed, acceleration, jerk;
};

// A path by its coordinates (rows) at equidistant values 0, step, 2·step … of a parameter (columns).
struct SampledPath {
  Eigen::MatrixXd points;
  double step = 0;
  std::vector<RateLimits> limits;  // one a row
};

// The parameter over time, from rest to rest.
class Pace {
 public:
  static constexpr double kTick_s = 0.001;

  // `at_ticks` is the parameter each tick, `excess` how much longer all of it must take to keep the limits, at least 1.
  Pace(std::vector<double> at_ticks, double excess) : at_ticks_(std::move(at_ticks)), excess_(excess) {}

  [[nodiscard]] double duration_s() const { return excess_ * kTick_s * static_cast<double>(at_ticks_.size() - 1); }
  // Before 0 the beginning, after the end the end.
  [[nodiscard]] double at(double t_s) const;

 private:
  std::vector<double> at_ticks_;
  double excess_;
};

// As fast as a few rounds of lowering what is too fast find; see line.hpp. At least five columns. None if that takes
// longer than `most_s`; work and memory grow with it.
[[nodiscard]] std::optional<Pace> find_pace(const SampledPath& path, double most_s);

}  // namespace pons::motion
