// Motion through via points. The positions are given; speed and acceleration there are chosen by descent on the total
// time: each axis' piece has a fastest duration, a piece takes as long as its slowest axis, and a power sum instead of
// the maximum tells the search what would become slowest next. Then axes that got too fast to wait for the slowest are
// slowed down. The descent does not see that waiting, so what it began with is sometimes the shorter motion: both are
// made. A fixed number of steps: the same input, the same motion.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "pons/motion/assemble.hpp"

namespace pons::motion {
namespace {

constexpr double kEndPosition = 1e-7;  // rad
constexpr double kEndSpeed = 1e-6;     // rad/s

constexpr int kSweeps = 7;
constexpr double kFirstStep = 0.3;  // of the limit
constexpr double kScales[] = {0, 0.5, 1, 1.5, 2, 3};
constexpr int kRelaxations = 2;
constexpr double kSlower[] = {0.8, 0.6, 0.4, 0.2, 0};

class Search {
 public:
  Search(const AxisState& start, std::span<const AxisVector> vias, const Waypoint& end, const AxisLimits& limits)
      : axes_(static_cast<std::size_t>(start.position.size())), points_(vias.size() + 2), times_(vias.size() + 1) {
    for (std::size_t i = 0; i < axes_; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      bounds_[i] = inner_bounds(limits, axis);
      points_.front()[i] = {start.position[axis], start.speed[axis], start.acceleration[axis]};
      for (std::size_t k = 0; k < vias.size(); ++k) points_[k + 1][i] = {vias[k][axis], 0, 0};
      points_.back()[i] = {end.position[axis], std::clamp(end.speed[axis], bounds_[i].speed_min, bounds_[i].speed_max),
                           0};
    }
  }

  [[nodiscard]] std::size_t pieces() const { return times_.size(); }
  [[nodiscard]] Piece piece(std::size_t k) const {
    Piece result;
    result.count = axes_;
    for (std::size_t i = 0; i < axes_; ++i) result.axes[i] = axis_piece(k, i);
    return result;
  }

  // Speeds as good as a look at the neighbours gives them. First.
  void guess() {
    guess_speeds();
    guessed_ = points_;
    relax_all();
  }
  // Better ones, from the guess on.
  void descend() {
    points_ = guessed_;
    refresh();
    double step = kFirstStep;
    for (int sweep = 0; sweep < kSweeps; ++sweep, step *= 0.5) {
      for (std::size_t k = 1; k + 1 < points_.size(); ++k) {
        for (std::size_t i = 0; i < axes_; ++i) {
          improve(k, i, step * bounds_[i].speed_max, 0);
          improve(k, i, 0, step * bounds_[i].acceleration_max);
        }
      }
    }
    relax_all();
  }
  // None: there is always a motion with a halt at every via point.
  void halt() {
    for (std::size_t k = 1; k + 1 < points_.size(); ++k) {
      for (std::size_t i = 0; i < axes_; ++i) points_[k][i] = {points_[k][i].position, 0, 0};
    }
  }

 private:
  using Points = std::array<AxisPoint, kMaxAxes>;
  using Times = std::array<double, kMaxAxes>;

  [[nodiscard]] AxisPiece axis_piece(std::size_t k, std::size_t i) const {
    return {points_[k][i], points_[k + 1][i], bounds_[i]};
  }

  // Near the maximum, but every axis counts a little.
  [[nodiscard]] double cost(const Times& times) const {
    const double most = *std::max_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(axes_));
    if (!(most < std::numeric_limits<double>::infinity()) || most == 0) return most;
    double sum = 0;
    for (std::size_t i = 0; i < axes_; ++i) {
      const double share = times[i] / most, square = share * share, fourth = square * square;
      sum += fourth * fourth;
    }
    return most * std::sqrt(std::sqrt(std::sqrt(sum)));
  }

  void refresh() {
    for (std::size_t k = 0; k < times_.size(); ++k) {
      for (std::size_t i = 0; i < axes_; ++i) times_[k][i] = fastest_duration_s(axis_piece(k, i));
    }
  }
  [[nodiscard]] double total() const {
    double sum = 0;
    for (const Times& times : times_) sum += cost(times);
    return sum;
  }

  // Speeds along the chord of the neighbours, zero where an axis turns back; the best of a few scales.
  void guess_speeds() {
    std::vector<Points> chord = points_;
    refresh();
    for (std::size_t k = 1; k + 1 < points_.size(); ++k) {
      const double duration = cost(times_[k - 1]) + cost(times_[k]);
      for (std::size_t i = 0; i < axes_; ++i) {
        const double before = points_[k][i].position - points_[k - 1][i].position;
        const double behind = points_[k + 1][i].position - points_[k][i].position;
        if (before * behind > 0 && duration > 0) chord[k][i].speed = (before + behind) / duration;
      }
    }
    double best = std::numeric_limits<double>::infinity(), best_scale = 0;
    for (const double scale : kScales) {
      scale_speeds(chord, scale);
      refresh();
      if (const double now = total(); now < best) best = now, best_scale = scale;
    }
    scale_speeds(chord, best_scale);
    refresh();
  }
  void scale_speeds(const std::vector<Points>& chord, double scale) {
    for (std::size_t k = 1; k + 1 < points_.size(); ++k) {
      for (std::size_t i = 0; i < axes_; ++i) {
        points_[k][i].speed = std::clamp(scale * chord[k][i].speed, bounds_[i].speed_min, bounds_[i].speed_max);
      }
    }
  }

  void improve(std::size_t k, std::size_t i, double speed_step, double acceleration_step) {
    if (!try_step(k, i, speed_step, acceleration_step)) try_step(k, i, -speed_step, -acceleration_step);
  }
  bool try_step(std::size_t k, std::size_t i, double speed_step, double acceleration_step) {
    const AxisPoint old = points_[k][i];
    AxisPoint& point = points_[k][i];
    point.speed += speed_step;
    point.acceleration += acceleration_step;
    const double bend = point.acceleration * point.acceleration / (2 * bounds_[i].jerk);
    if (std::abs(point.acceleration) > bounds_[i].acceleration_max ||
        std::abs(point.speed) + bend > bounds_[i].speed_max) {
      point = old;
      return false;
    }
    Times before = times_[k - 1], behind = times_[k];
    before[i] = fastest_duration_s(axis_piece(k - 1, i));
    behind[i] = fastest_duration_s(axis_piece(k, i));
    if (cost(before) + cost(behind) < cost(times_[k - 1]) + cost(times_[k])) {
      times_[k - 1] = before;
      times_[k] = behind;
      return true;
    }
    point = old;
    return false;
  }

  // How long piece k really takes: some axis may not be able to wait for the slowest.
  [[nodiscard]] double real_duration(std::size_t k) const {
    const Times& times = times_[k];
    const double most = *std::max_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(axes_));
    double real = most;
    for (std::size_t i = 0; i < axes_ && std::isfinite(real); ++i) {
      if (times[i] < most) real = std::max(real, possible_duration_s(axis_piece(k, i), real));
    }
    return real;
  }
  void relax_all() {
    for (int round = 0; round < kRelaxations; ++round) relax();
  }
  void relax() {
    for (std::size_t k = 0; k < pieces(); ++k) {
      const Times& times = times_[k];
      const double most = *std::max_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(axes_));
      for (std::size_t i = 0; i < axes_; ++i) {
        if (times[i] >= most || possible_duration_s(axis_piece(k, i), most) <= most) continue;
        if (k > 0) slow_down(k, i);
        if (k + 1 < pieces()) slow_down(k + 1, i);
      }
    }
  }
  // The share of its speed and acceleration at via k with which axis i costs least.
  void slow_down(std::size_t k, std::size_t i) {
    const auto use = [&](const AxisPoint& point) {
      points_[k][i] = point;
      times_[k - 1][i] = fastest_duration_s(axis_piece(k - 1, i));
      times_[k][i] = fastest_duration_s(axis_piece(k, i));
      return real_duration(k - 1) + real_duration(k);
    };
    const AxisPoint full = points_[k][i];
    AxisPoint best = full;
    double least = use(full);
    for (const double share : kSlower) {
      const AxisPoint slower{full.position, share * full.speed, share * full.acceleration};
      if (const double now = use(slower); now < least) least = now, best = slower;
    }
    use(best);
  }

  std::size_t axes_;
  std::array<AxisBounds, kMaxAxes> bounds_{};
  std::vector<Points> points_, guessed_;  // start, vias, end
  std::vector<Times> times_;              // each piece's and axis' fastest duration
};

// Among the durations in which a piece with acceleration at both ends seems possible there are a few in which it is
// not: what counts is that each axis ends where it should.
bool arrives(const Piece& piece, std::span<const AxisProfile> profiles) {
  for (std::size_t i = 0; i < piece.count; ++i) {
    const AxisPoint& end = profiles[i].end();
    const AxisPoint& to = piece.axes[i].to;
    if (std::abs(end.position - to.position) > kEndPosition || std::abs(end.speed - to.speed) > kEndSpeed) return false;
  }
  return true;
}

// The piece's duration, the shortest of a few in which every axis arrives.
Expected<double> plan_longer(const Piece& piece, const AxisLimits& limits, std::span<AxisProfile> profiles) {
  const double shortest_s = common_duration_s(piece);
  Expected<void> planned =
      fail("no motion of acceptable length found", "motion", "choose another start, via point or end");
  for (const double stretch : {1.0, 1.02, 1.06, 1.15, 1.4}) {
    const double duration_s = to_s(ceil_ns(stretch * shortest_s));
    if (!std::isfinite(shortest_s)) break;
    for (std::size_t i = 0; i < piece.count; ++i) profiles[i] = plan_in_time(piece.axes[i], duration_s);
    auto ok = check_way(profiles, limits);
    if (ok && arrives(piece, profiles)) return duration_s;
    if (!ok) planned = std::move(ok);
  }
  return std::unexpected(planned.error());
}

Expected<Trajectory> assemble(const Search& search, Time at, const AxisLimits& limits) {
  Trajectory trajectory;
  std::array<AxisProfile, kMaxAxes> profiles;
  for (std::size_t k = 0; k < search.pieces(); ++k) {
    const Piece piece = search.piece(k);
    const std::span<AxisProfile> used(profiles.data(), piece.count);
    const auto duration_s = plan_longer(piece, limits, used);
    if (!duration_s) return std::unexpected(duration_s.error());
    append(used, at, ceil_ns(*duration_s), trajectory);
    at += ceil_ns(*duration_s);
  }
  if (trajectory.empty()) append(std::span(profiles.data(), search.piece(0).count), at, Duration{1}, trajectory);
  return trajectory;
}

}  // namespace

Expected<Trajectory> move_through(const AxisState& start, Time at, std::span<const AxisVector> vias,
                                  const Waypoint& end, const AxisLimits& limits, Effort effort) {
  if (vias.empty()) return move(start, at, end, limits);
  if (auto ok = check_start(start, limits); !ok) return std::unexpected(ok.error());
  if (auto ok = check_waypoint(end, "end", limits); !ok) return std::unexpected(ok.error());
  for (const AxisVector& via : vias) {
    if (auto ok = check_waypoint({via, AxisVector::Zero(via.size())}, "via point", limits); !ok) {
      return std::unexpected(ok.error());
    }
  }
  Search search(start, vias, end, limits);
  search.guess();
  Expected<Trajectory> best = assemble(search, at, limits);
  if (effort == Effort::kFine) {
    search.descend();
    Expected<Trajectory> fine = assemble(search, at, limits);
    if (fine && (!best || fine->back().end() < best->back().end())) best = std::move(fine);
  }
  if (best) return best;
  search.halt();
  return assemble(search, at, limits);
}

}  // namespace pons::motion
