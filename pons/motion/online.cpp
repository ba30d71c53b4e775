#include "pons/motion/online.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

namespace pons::motion {
namespace {

// Durations that differ less, relatively, count as one.
constexpr double kSameDuration = 1e-14;
// Directions that differ less, relatively, count as one: what dividing and multiplying again leaves, and more.
constexpr double kSameDirection = 1e-12;
constexpr double kSameSpeed = 1 + 1e-9;

using Planned = std::expected<double, OnlineError>;

Planned check(const OnlineOptions& options, std::size_t axes, std::size_t profiles) {
  if (axes < 1 || axes > kMostTasks || profiles != axes) return std::unexpected(OnlineError::kCount);
  if (!std::isfinite(options.least_s + options.grid_s)) return std::unexpected(OnlineError::kNotFinite);
  if (options.least_s < 0 || options.grid_s < 0) return std::unexpected(OnlineError::kBounds);
  return options.synchronization == Synchronization::kNone ? 0 : options.least_s;
}

std::optional<OnlineError> find_error(const AxisTask& task, double end_position) {
  const AxisBounds& bounds = task.bounds;
  const double sum = task.start.position + task.start.speed + task.start.acceleration + end_position + task.end_speed +
                     bounds.speed_min + bounds.speed_max + bounds.acceleration_min + bounds.acceleration_max +
                     bounds.jerk;
  if (!std::isfinite(sum)) return OnlineError::kNotFinite;
  if (bounds.speed_min >= 0 || bounds.speed_max <= 0 || bounds.acceleration_min >= 0 || bounds.acceleration_max <= 0 ||
      bounds.jerk <= 0) {
    return OnlineError::kBounds;
  }
  if (task.end_speed > bounds.speed_max || task.end_speed < bounds.speed_min) return OnlineError::kEndSpeed;
  return {};
}

double on_grid(double duration_s, double grid_s) {
  return grid_s > 0 ? std::ceil(duration_s / grid_s) * grid_s : duration_s;
}

enum class Target : std::uint8_t { kPosition, kSpeed };

// A motion of all axes along one straight line, as a task of the axis that goes farthest and the others' shares of it.
struct Line {
  std::size_t leader = 0;
  AxisTask task;
  std::array<double, kMostTasks> shares{};
};

// The tightest bounds of all axes, as the leader's.
void tighten(AxisBounds& bounds, const AxisBounds& other, double share) {
  if (share == 0) return;
  const bool along = share > 0;
  bounds.speed_max = std::min(bounds.speed_max, (along ? other.speed_max : other.speed_min) / share);
  bounds.speed_min = std::max(bounds.speed_min, (along ? other.speed_min : other.speed_max) / share);
  bounds.acceleration_max =
      std::min(bounds.acceleration_max, (along ? other.acceleration_max : other.acceleration_min) / share);
  bounds.acceleration_min =
      std::max(bounds.acceleration_min, (along ? other.acceleration_min : other.acceleration_max) / share);
  bounds.jerk = std::min(bounds.jerk, other.jerk / std::abs(share));
}

// None if a speed, an acceleration or the way has another direction than the rest, or if the jerk that suits all axes
// would let one get faster than it may before its acceleration is taken back.
std::optional<Line> find_line(std::span<const AxisTask> tasks, Target target) {
  std::array<std::array<double, kMostTasks>, 4> vectors{};
  std::array<double, 4> lengths{};
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const AxisTask& task = tasks[i];
    const double way = target == Target::kPosition ? task.end_position - task.start.position : 0;
    const std::array values{way, task.end_speed, task.start.speed, task.start.acceleration};
    for (std::size_t k = 0; k < values.size(); ++k) {
      vectors[k][i] = values[k];
      lengths[k] = std::max(lengths[k], std::abs(values[k]));
    }
  }
  std::size_t first = 0;
  while (first < lengths.size() && lengths[first] == 0) ++first;
  if (first == lengths.size()) return {};
  const auto& direction = vectors[first];
  Line line;
  while (std::abs(direction[line.leader]) < lengths[first]) ++line.leader;
  line.task = tasks[line.leader];
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    line.shares[i] = direction[i] / direction[line.leader];
    for (std::size_t k = 0; k < vectors.size(); ++k) {
      const double off = vectors[k][i] - line.shares[i] * vectors[k][line.leader];
      if (std::abs(off) > kSameDirection * lengths[k]) return {};
    }
    tighten(line.task.bounds, tasks[i].bounds, line.shares[i]);
  }
  const AxisBounds& bounds = line.task.bounds;
  const double coasting = coasting_speed(line.task.start, bounds.jerk);
  if (target == Target::kPosition &&
      (coasting > bounds.speed_max * kSameSpeed || coasting < bounds.speed_min * kSameSpeed))
    return {};
  line.task.end_speed = std::clamp(line.task.end_speed, line.task.bounds.speed_min, line.task.bounds.speed_max);
  return line;
}

// The leader's motion for all.
void spread(const Line& line, std::span<const AxisTask> tasks, std::span<AxisProfile> profiles) {
  const AxisProfile& leader = profiles[line.leader];
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (i == line.leader) continue;
    profiles[i].restart(tasks[i].start);
    for (std::size_t k = 0; k < leader.phases(); ++k) {
      profiles[i].add(leader.begin_s(k + 1) - leader.begin_s(k), line.shares[i] * leader.jerk(k),
                      line.shares[i] * leader.begin(k + 1).acceleration);
    }
  }
}

}  // namespace

const char* text(OnlineError error) {
  switch (error) {
    case OnlineError::kCount:
      return "no axis, too many, or not one profile an axis";
    case OnlineError::kNotFinite:
      return "a value is not finite";
    case OnlineError::kBounds:
      return "bounds contradict each other";
    case OnlineError::kEndSpeed:
      return "an end speed is beyond its bounds";
    case OnlineError::kTooLong:
      return "the motion takes too long";
  }
  return "";
}

Planned plan_positions(std::span<const AxisTask> tasks, const OnlineOptions& options,
                       std::span<AxisProfile> profiles) PONS_NONBLOCKING {
  Planned duration = check(options, tasks.size(), profiles.size());
  std::array<PositionPlan, kMostTasks> plans;
  for (std::size_t i = 0; duration && i < tasks.size(); ++i) {
    if (const auto error = find_error(tasks[i], tasks[i].end_position)) return std::unexpected(*error);
    const double fastest_s = std::construct_at(&plans[i], tasks[i])->duration_s();
    if (!(fastest_s <= kLongestMotion_s)) return std::unexpected(OnlineError::kTooLong);
    duration = std::max(*duration, fastest_s);
  }
  if (!duration) return duration;
  if (options.synchronization == Synchronization::kPhase) {
    if (const auto line = find_line(tasks, Target::kPosition)) {
      duration = plan_positions(std::span(&line->task, 1), {Synchronization::kTime, options.least_s, options.grid_s},
                                profiles.subspan(line->leader, 1));
      if (duration) spread(*line, tasks, profiles);
      return duration;
    }
  }
  if (options.synchronization == Synchronization::kNone) {
    for (std::size_t i = 0; i < tasks.size(); ++i) plans[i].fastest(profiles[i]);
    return duration;
  }
  // Each axis has one interval of impossible durations at most, and the duration only grows: so this ends.
  for (std::size_t round = 0; round <= tasks.size(); ++round) {
    const double before_s = *duration = on_grid(*duration, options.grid_s);
    for (std::size_t i = 0; i < tasks.size(); ++i) duration = std::max(*duration, plans[i].possible_s(*duration));
    if (*duration <= before_s * (1 + kSameDuration)) break;
  }
  if (!(*duration <= kLongestMotion_s)) return std::unexpected(OnlineError::kTooLong);
  for (std::size_t i = 0; i < tasks.size(); ++i) plans[i].in_time(*duration, profiles[i]);
  return duration;
}

Planned plan_speeds(std::span<const AxisTask> tasks, const OnlineOptions& options,
                    std::span<AxisProfile> profiles) PONS_NONBLOCKING {
  Planned duration = check(options, tasks.size(), profiles.size());
  std::array<SpeedPlan, kMostTasks> plans;
  std::size_t slowest = 0;
  for (std::size_t i = 0; duration && i < tasks.size(); ++i) {
    const AxisTask& task = tasks[i];
    if (const auto error = find_error(task, 0)) return std::unexpected(*error);
    std::construct_at(&plans[i], task.start, task.end_speed, task.bounds);
    if (!(plans[i].duration_s() <= kLongestMotion_s)) return std::unexpected(OnlineError::kTooLong);
    if (plans[i].duration_s() > plans[slowest].duration_s()) slowest = i;
  }
  if (!duration) return duration;
  if (options.synchronization == Synchronization::kPhase) {
    if (const auto line = find_line(tasks, Target::kSpeed)) {
      duration = plan_speeds(std::span(&line->task, 1), {Synchronization::kTime, options.least_s, options.grid_s},
                             profiles.subspan(line->leader, 1));
      if (duration) spread(*line, tasks, profiles);
      return duration;
    }
  }
  const double fastest_s = plans[slowest].duration_s();
  if (options.synchronization == Synchronization::kNone) {
    for (std::size_t i = 0; i < tasks.size(); ++i) plans[i].fastest(profiles[i]);
    return std::max(*duration, fastest_s);
  }
  duration = on_grid(std::max(*duration, fastest_s), options.grid_s);
  if (!(*duration <= kLongestMotion_s)) return std::unexpected(OnlineError::kTooLong);
  // How much of its change of speed the slowest has behind it, on the average.
  const AxisTask& leader = tasks[slowest];
  const double change = (leader.end_speed - leader.start.speed) * fastest_s;
  const double way = plans[slowest].end_position() - leader.start.position - leader.start.speed * fastest_s;
  const double share = change == 0 ? 0.5 : std::clamp(way / change, 0.0, 1.0);
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const AxisTask& task = tasks[i];
    const double mean_speed = task.start.speed + share * (task.end_speed - task.start.speed);
    plans[i].in_time(*duration, task.start.position + *duration * mean_speed, profiles[i]);
  }
  return duration;
}

}  // namespace pons::motion
