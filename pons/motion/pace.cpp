#include "pons/motion/pace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pons::motion {
namespace {

constexpr double kShare = 0.95;      // of accelerations and jerks that the path's bends may use up by themselves
constexpr double kLeastPush = 0.08;  // share of an acceleration that is left to speed in any case
constexpr double kSecond_s = 0.016;  // the second average: jerk then has no steps
constexpr int kRounds = 16;
constexpr double kLower = 0.6, kLowerPush = 1.0;  // powers of the excess by which caps and pushes are lowered
constexpr double kGood = 1.002;

using Eigen::Index;

class PaceSearch {
 public:
  explicit PaceSearch(const SampledPath& path) : path_(path), nodes_(path.points.cols()) {
    differentiate();
    double window_s = 0;
    for (const RateLimits& limit : path.limits) window_s = std::max(window_s, limit.acceleration / limit.jerk);
    first_ = ticks(window_s), second_ = ticks(kSecond_s);
    cap_.resize(static_cast<std::size_t>(nodes_));
    push_.assign(cap_.size(), 1.0);
    for (Index k = 0; k < nodes_; ++k) cap_[static_cast<std::size_t>(k)] = cap(k);
  }

  std::optional<Pace> run(double most_s) {
    std::vector<double> best;
    double best_excess = 1, least = std::numeric_limits<double>::infinity();
    for (int round = 0; round < kRounds; ++round) {
      // Caps are only lowered, so what takes too long once does so in every later round.
      if (speed_up_and_down(); !(time() <= most_s)) break;
      const std::vector<double> smooth = average(average(over_time(), first_), second_);
      const double excess = std::max(1.0, judge(smooth));
      if (const double length = excess * static_cast<double>(smooth.size()); length < least) {
        least = length, best = smooth, best_excess = excess;
      }
      if (excess <= kGood) break;
      lower();
    }
    if (best.empty()) return std::nullopt;
    Pace pace(std::move(best), best_excess);
    if (!(pace.duration_s() <= most_s)) return std::nullopt;
    return pace;
  }

 private:
  static std::size_t ticks(double seconds) {
    return std::max<std::size_t>(1, static_cast<std::size_t>(std::ceil(seconds / Pace::kTick_s)));
  }

  // Central differences; at the ends those of the nearest column that has them.
  void differentiate() {
    const Eigen::MatrixXd& p = path_.points;
    const double h = path_.step;
    first_derivative_ = second_derivative_ = third_derivative_ = Eigen::MatrixXd::Zero(p.rows(), nodes_);
    for (Index k = 0; k < nodes_; ++k) {
      const Index c = std::clamp<Index>(k, 2, nodes_ - 3);
      first_derivative_.col(k) = (p.col(c + 1) - p.col(c - 1)) / (2 * h);
      second_derivative_.col(k) = (p.col(c + 1) - 2 * p.col(c) + p.col(c - 1)) / (h * h);
      third_derivative_.col(k) = (p.col(c + 2) - 2 * p.col(c + 1) + 2 * p.col(c - 1) - p.col(c - 2)) / (2 * h * h * h);
    }
  }

  // Of the parameter's speed at a node, were it constant.
  [[nodiscard]] double cap(Index k) const {
    double most = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < path_.points.rows(); ++i) {
      const RateLimits& limit = path_.limits[static_cast<std::size_t>(i)];
      most = std::min(most, limit.speed / std::abs(first_derivative_(i, k)));
      most = std::min(most, std::sqrt(kShare * limit.acceleration / std::abs(second_derivative_(i, k))));
      most = std::min(most, std::cbrt(kShare * limit.jerk / std::abs(third_derivative_(i, k))));
    }
    return most;
  }
  // What may be added to the parameter's speed each second.
  [[nodiscard]] double push(Index k, double speed) const {
    double most = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < path_.points.rows(); ++i) {
      const double limit = path_.limits[static_cast<std::size_t>(i)].acceleration;
      const double left = std::max(kLeastPush * limit, limit - std::abs(second_derivative_(i, k)) * speed * speed);
      most = std::min(most, left / std::abs(first_derivative_(i, k)));
    }
    return push_[static_cast<std::size_t>(k)] * most;
  }

  void speed_up_and_down() {
    speed_ = cap_;
    speed_.front() = speed_.back() = 0;
    const auto pass = [&](Index from, Index to) {
      const double before = speed_[static_cast<std::size_t>(from)];
      double& here = speed_[static_cast<std::size_t>(to)];
      here = std::min(here, std::sqrt(before * before + 2 * path_.step * std::min(push(from, before), push(to, here))));
    };
    for (Index k = 1; k < nodes_; ++k) pass(k - 1, k);
    for (Index k = nodes_ - 2; k >= 0; --k) pass(k + 1, k);
  }

  // When each node is passed, between nodes with constant acceleration; the last of these times.
  double time() {
    times_.assign(cap_.size(), 0);
    for (std::size_t k = 0; k + 1 < speed_.size(); ++k) {
      times_[k + 1] = times_[k] + 2 * path_.step / (speed_[k] + speed_[k + 1]);
    }
    return times_.back();
  }

  // The parameter each tick.
  std::vector<double> over_time() {
    std::vector<double> result;
    double t = 0;  // of the next tick
    for (std::size_t k = 0; k + 1 < speed_.size(); ++k) {
      const double here = speed_[k], gain = (speed_[k + 1] - here) / (times_[k + 1] - times_[k]);
      for (; t < times_[k + 1]; t += Pace::kTick_s) {
        const double on = t - times_[k];
        result.push_back(path_.step * static_cast<double>(k) + on * (here + 0.5 * on * gain));
      }
    }
    result.push_back(path_.step * static_cast<double>(nodes_ - 1));
    return result;
  }

  // The mean over the last `window` ticks, at rest before and after: as much longer, and smoother by one derivative.
  static std::vector<double> average(const std::vector<double>& values, std::size_t window) {
    std::vector<double> result(values.size() + window);
    double sum = values.front() * static_cast<double>(window);
    for (std::size_t i = 0; i < result.size(); ++i) {
      sum += values[std::min(i, values.size() - 1)] - (i >= window ? values[i - window] : values.front());
      result[i] = sum / static_cast<double>(window);
    }
    result.back() = values.back();
    return result;
  }

  // How much longer than `smooth` the path must take; notes at each node by how much it is too fast about there.
  double judge(const std::vector<double>& smooth) {
    constexpr double h = Pace::kTick_s;
    excess_.assign(cap_.size(), 0);
    double worst = 0;
    for (std::size_t i = 2; i + 2 < smooth.size(); ++i) {
      const double speed = (smooth[i + 1] - smooth[i - 1]) / (2 * h);
      const double acceleration = (smooth[i + 1] - 2 * smooth[i] + smooth[i - 1]) / (h * h);
      const double jerk = (smooth[i + 2] - 2 * smooth[i + 1] + 2 * smooth[i - 1] - smooth[i - 2]) / (2 * h * h * h);
      const double excess = excess_at(smooth[i], speed, acceleration, jerk);
      worst = std::max(worst, excess);
      if (excess <= 1) continue;
      // The averages look so far back.
      const double until = static_cast<double>(i) * h, from = until - static_cast<double>(first_ + second_) * h;
      auto node = std::ranges::lower_bound(times_, from) - times_.begin();
      for (node = std::max<std::ptrdiff_t>(0, node - 1); node < static_cast<std::ptrdiff_t>(times_.size()); ++node) {
        const auto k = static_cast<std::size_t>(node);
        excess_[k] = std::max(excess_[k], excess);
        if (times_[k] > until) break;
      }
    }
    return worst;
  }
  [[nodiscard]] double excess_at(double parameter, double speed, double acceleration, double jerk) const {
    const double at = std::clamp(parameter / path_.step, 0.0, static_cast<double>(nodes_ - 1));
    const Index k = std::min(static_cast<Index>(at), nodes_ - 2);
    const double share = at - static_cast<double>(k);
    double fastest = 0, most_pushed = 0, most_jerked = 0;
    for (Index i = 0; i < path_.points.rows(); ++i) {
      const auto between = [&](const Eigen::MatrixXd& d) { return d(i, k) + share * (d(i, k + 1) - d(i, k)); };
      const double d1 = between(first_derivative_), d2 = between(second_derivative_), d3 = between(third_derivative_);
      const RateLimits& limit = path_.limits[static_cast<std::size_t>(i)];
      const double a = d2 * speed * speed + d1 * acceleration;
      const double j = d3 * speed * speed * speed + 3 * d2 * speed * acceleration + d1 * jerk;
      fastest = std::max(fastest, std::abs(d1 * speed) / limit.speed);
      most_pushed = std::max(most_pushed, std::abs(a) / limit.acceleration);
      most_jerked = std::max(most_jerked, std::abs(j) / limit.jerk);
    }
    return std::max({fastest, std::sqrt(most_pushed), std::cbrt(most_jerked)});
  }

  void lower() {
    for (std::size_t k = 1; k + 1 < cap_.size(); ++k) {
      if (excess_[k] <= 1) continue;
      cap_[k] = std::min(cap_[k], speed_[k] * std::pow(excess_[k], -kLower));
      push_[k] *= std::pow(excess_[k], -kLowerPush);
    }
  }

  const SampledPath& path_;
  Index nodes_;
  std::size_t first_, second_;  // ticks of the averages
  Eigen::MatrixXd first_derivative_, second_derivative_, third_derivative_;
  std::vector<double> cap_, push_, speed_, times_, excess_;  // each node's
};

}  // namespace

double cubic(const std::vector<double>& values, std::size_t k, double share) {
  const double p1 = values[k], p2 = values[k + 1], t = share;
  const double p0 = k > 0 ? values[k - 1] : 2 * p1 - p2, p3 = k + 2 < values.size() ? values[k + 2] : 2 * p2 - p1;
  return p1 + 0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)));
}

double Pace::at(double t_s) const {
  const double x = t_s / (excess_ * kTick_s);
  if (!(x > 0)) return at_ticks_.front();
  if (x >= static_cast<double>(at_ticks_.size() - 1)) return at_ticks_.back();
  const auto k = static_cast<std::size_t>(x);
  return cubic(at_ticks_, k, x - static_cast<double>(k));
}

std::optional<Pace> find_pace(const SampledPath& path, double most_s) { return PaceSearch(path).run(most_s); }

}  // namespace pons::motion
