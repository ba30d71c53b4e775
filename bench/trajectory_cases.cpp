#include "bench/trajectory_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pons::bench {
namespace {

using motion::AxisBounds;
using motion::AxisPoint;
using motion::AxisProfile;
using motion::AxisTask;

double decade(Random& random, double low, double high) {
  return std::exp(random.uniform(std::log(low), std::log(high)));
}

AxisTask draw_random(Random& random) {
  AxisTask task;
  task.start.position = 4 * random.normal();
  task.start.speed = random.uniform() < 0.9 ? 0.8 * random.normal() : 0;
  task.start.acceleration = random.uniform() < 0.8 ? 0.8 * random.normal() : 0;
  task.end_position = 4 * random.normal();
  task.end_speed = random.uniform() < 0.7 ? 0.8 * random.normal() : 0;
  const double speed = random.uniform(0.08, 16) + std::abs(task.end_speed);
  const double acceleration = random.uniform(0.08, 16), jerk = random.uniform(0.08, 16);
  task.bounds = AxisBounds::symmetric(speed, acceleration, jerk);
  return task;
}

// Zero, a bound, inside, beyond.
double draw_value(Random& random, double low, double high) {
  switch (random.below(6)) {
    case 0:
      return 0;
    case 1:
      return low;
    case 2:
      return high;
    case 3:
      return random.uniform(1.5 * low, 1.5 * high);
    default:
      return random.uniform(low, high);
  }
}

AxisTask draw_hard(Random& random) {
  const double unit = random.below(2) == 0 ? 1 : decade(random, 1e-3, 1e3);
  // In terms of the times it takes to get up to speed, and up to acceleration.
  const double speed = unit * decade(random, 0.03, 30), acceleration = speed / decade(random, 1e-3, 10);
  AxisTask task;
  task.bounds = {-speed * decade(random, 0.2, 5), speed, -acceleration * decade(random, 0.2, 5), acceleration,
                 acceleration / std::min(speed / acceleration * decade(random, 1e-5, 3), 5.0)};
  task.start.position = random.below(3) == 0 ? 0 : unit * random.normal();
  task.start.speed = draw_value(random, task.bounds.speed_min, task.bounds.speed_max);
  task.start.acceleration = draw_value(random, task.bounds.acceleration_min, task.bounds.acceleration_max);
  const double way = random.below(6) == 0 ? 0 : unit * decade(random, 1e-9, 30);
  task.end_position = task.start.position + (random.below(2) == 0 ? way : -way);
  task.end_speed = std::clamp(draw_value(random, task.bounds.speed_min, task.bounds.speed_max), task.bounds.speed_min,
                              task.bounds.speed_max);
  return task;
}

// The lowest and highest speed and acceleration of one phase.
struct Range {
  double speed_min, speed_max, acceleration_min, acceleration_max;
};
Range range(const AxisPoint& from, const AxisPoint& to, double jerk) {
  Range result{std::min(from.speed, to.speed), std::max(from.speed, to.speed),
               std::min(from.acceleration, to.acceleration), std::max(from.acceleration, to.acceleration)};
  if (from.acceleration * to.acceleration < 0 && jerk != 0) {
    const double turn = from.speed - from.acceleration * from.acceleration / (2 * jerk);
    result.speed_min = std::min(result.speed_min, turn), result.speed_max = std::max(result.speed_max, turn);
  }
  return result;
}

double beyond(double low, double high, double least, double most) {
  return std::max({0.0, low / least - 1, high / most - 1});
}

bool is_inside(const AxisPoint& point, const AxisBounds& bounds) {
  const double slack = 1 + kTolerance.beyond, coasting = coasting_speed(point, bounds.jerk);
  return point.acceleration <= bounds.acceleration_max * slack &&
         point.acceleration >= bounds.acceleration_min * slack &&
         std::max(point.speed, coasting) <= bounds.speed_max * slack &&
         std::min(point.speed, coasting) >= bounds.speed_min * slack;
}

// What a moment may be off by, as a number: sums of phases, relative to the whole.
constexpr double kMoment = 4e-15;

// Of the way from phase to phase.
void look(const AxisTask& task, const AxisProfile& profile, Worst& seen) {
  const AxisBounds& bounds = task.bounds;
  const double moment_s = kMoment * profile.duration_s(), jerk_off = bounds.jerk * moment_s;
  const double acceleration_off = moment_s * std::max(bounds.acceleration_max, -bounds.acceleration_min);
  const double speed_off = moment_s * std::max(bounds.speed_max, -bounds.speed_min);
  bool inside = false;
  for (std::size_t i = 0; i < profile.phases(); ++i) {
    const AxisPoint &from = profile.begin(i), &next = profile.begin(i + 1);
    const AxisPoint to = after(from, profile.begin_s(i + 1) - profile.begin_s(i), profile.jerk(i));
    const auto off = [](double a, double b, double unresolved) {
      return std::max(0.0, std::abs(a - b) - unresolved) / (1 + std::abs(a));
    };
    seen.seam = std::max({seen.seam, off(to.position, next.position, 2 * speed_off),
                          off(to.speed, next.speed, 2 * acceleration_off),
                          off(to.acceleration, next.acceleration, 2 * jerk_off)});
    seen.jerk = std::max(seen.jerk, std::abs(profile.jerk(i)) / bounds.jerk - 1);
    inside = inside || is_inside(from, bounds);
    if (!inside) continue;
    const Range range = bench::range(from, next, profile.jerk(i));
    seen.beyond = std::max({seen.beyond,
                            beyond(range.speed_min + acceleration_off, range.speed_max - acceleration_off,
                                   bounds.speed_min, bounds.speed_max),
                            beyond(range.acceleration_min + jerk_off, range.acceleration_max - jerk_off,
                                   bounds.acceleration_min, bounds.acceleration_max)});
  }
}

}  // namespace

void draw(Random& random, Kind kind, std::span<AxisTask> tasks) {
  for (AxisTask& task : tasks) task = kind == Kind::kRandom ? draw_random(random) : draw_hard(random);
}

void Worst::take(const Worst& other) {
  position = std::max(position, other.position), speed = std::max(speed, other.speed);
  acceleration = std::max(acceleration, other.acceleration), beyond = std::max(beyond, other.beyond);
  jerk = std::max(jerk, other.jerk), seam = std::max(seam, other.seam);
}

std::string Worst::line() const {
  return fmt::format(
      "end off by {:.1e} in position, {:.1e} in speed, {:.1e} in acceleration; beyond bounds by {:.1e} of "
      "them, of jerk {:.1e}; seams {:.1e}",
      position, speed, acceleration, beyond, jerk, seam);
}

bool is_right(std::span<const AxisTask> tasks, std::span<const AxisProfile> profiles, double duration_s, End end,
              Worst& worst) {
  bool right = true;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const AxisTask& task = tasks[i];
    const AxisProfile& profile = profiles[i];
    const double own_s = profile.duration_s(), spare_s = end == End::kTogether ? duration_s - own_s : 0;
    const AxisPoint last = after(profile.end(), spare_s, 0);
    const AxisProfile::Extent extent = profile.extent();
    const double most = std::max({1.0, std::abs(extent.position_min), std::abs(extent.position_max)});
    // What numbers cannot resolve is taken off.
    const double moment_s = kMoment * duration_s;
    Worst seen{
        std::max(0.0, std::abs(last.position - task.end_position) - 1e-13 * (most - 1) - moment_s * extent.speed_max),
        std::max(0.0,
                 std::abs(last.speed - task.end_speed) - 1e-13 * extent.speed_max - moment_s * extent.acceleration_max),
        std::abs(last.acceleration),
        0,
        0,
        0};
    look(task, profile, seen);
    const double rest_s = task.end_speed == 0 ? 30e-9 : 0;  // what ends at rest may end that much sooner
    const bool in_time = spare_s <= rest_s + 1e-12 * (1 + duration_s) && spare_s >= -1e-12 * (1 + duration_s);
    right = right && in_time && seen.position <= kTolerance.position && seen.speed <= kTolerance.speed &&
            seen.acceleration <= kTolerance.acceleration && seen.beyond <= kTolerance.beyond &&
            seen.jerk <= kTolerance.jerk && seen.seam <= kTolerance.seam;
    worst.take(seen);
  }
  return right;
}

std::string line(const AxisTask& task) {
  return fmt::format(
      "{{{{{:.17g}, {:.17g}, {:.17g}}}, {:.17g}, {:.17g}, {{{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}}}}}",
      task.start.position, task.start.speed, task.start.acceleration, task.end_position, task.end_speed,
      task.bounds.speed_min, task.bounds.speed_max, task.bounds.acceleration_min, task.bounds.acceleration_max,
      task.bounds.jerk);
}

}  // namespace pons::bench
