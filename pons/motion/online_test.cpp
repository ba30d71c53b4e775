#include "pons/motion/online.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/core/test_allocations.hpp"

namespace pons::motion {
namespace {

constexpr double kTight = 1e-9;
constexpr double kSlack = 1 + 1e-10;

using Tasks = std::vector<AxisTask>;
using Profiles = std::vector<AxisProfile>;

double draw_inside(Random& random, double low, double high) {
  switch (random.below(5)) {
    case 0:
      return 0;
    case 1:
      return random.below(2) == 0 ? low : high;
    default:
      return random.uniform(low, high);
  }
}

// Any start, some beyond the bounds, which differ by direction and over decades.
AxisTask draw_task(Random& random, double excess = 1.5) {
  const auto decade = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
  AxisTask task;
  const double speed = decade(0.2, 5), acceleration = speed * decade(0.3, 30), jerk = acceleration * decade(1, 100);
  task.bounds = {-speed * decade(0.3, 3), speed, -acceleration * decade(0.3, 3), acceleration, jerk};
  task.start = {random.uniform(-3, 3), excess * draw_inside(random, task.bounds.speed_min, task.bounds.speed_max),
                excess * draw_inside(random, task.bounds.acceleration_min, task.bounds.acceleration_max)};
  task.end_position = random.below(8) == 0 ? task.start.position : random.uniform(-3, 3);
  task.end_speed = draw_inside(random, task.bounds.speed_min, task.bounds.speed_max);
  return task;
}

Tasks draw(Random& random, std::size_t axes) {
  Tasks tasks;
  for (std::size_t i = 0; i < axes; ++i) tasks.push_back(draw_task(random));
  return tasks;
}

bool is_inside(const AxisPoint& point, const AxisBounds& bounds) {
  const double coasting = coasting_speed(point, bounds.jerk);
  return point.acceleration <= bounds.acceleration_max * kSlack &&
         point.acceleration >= bounds.acceleration_min * kSlack &&
         std::max(point.speed, coasting) <= bounds.speed_max * kSlack &&
         std::min(point.speed, coasting) >= bounds.speed_min * kSlack;
}

// Inside, once it is: acceleration is extreme at switches, and so is speed, or where the acceleration is zero; there it
// is the coasting speed of the switch before or behind.
void expect_limits(const AxisProfile& profile, const AxisBounds& bounds) {
  bool inside = false;
  for (std::size_t i = 0; i <= profile.phases(); ++i) {
    const AxisPoint& point = profile.begin(i);
    ASSERT_LE(i < profile.phases() ? std::abs(profile.jerk(i)) : 0, bounds.jerk * kSlack);
    inside = inside || is_inside(point, bounds);
    if (!inside) continue;
    ASSERT_LE(point.acceleration, bounds.acceleration_max * kSlack);
    ASSERT_GE(point.acceleration, bounds.acceleration_min * kSlack);
    ASSERT_LE(point.speed, bounds.speed_max * kSlack);
    ASSERT_GE(point.speed, bounds.speed_min * kSlack);
    if (i == profile.phases() || point.acceleration * profile.begin(i + 1).acceleration >= 0) continue;
    const double turn = point.speed - point.acceleration * point.acceleration / (2 * profile.jerk(i));
    ASSERT_LE(turn, bounds.speed_max * kSlack);
    ASSERT_GE(turn, bounds.speed_min * kSlack);
  }
  ASSERT_TRUE(inside);
}

void expect_end(const AxisProfile& profile, double at_s, const AxisTask& task) {
  const AxisPoint end = profile.at(at_s);
  EXPECT_NEAR(end.position, task.end_position, kTight);
  EXPECT_NEAR(end.speed, task.end_speed, kTight);
  EXPECT_NEAR(end.acceleration, 0, kTight);
}

// Push to a peak acceleration, hold it, let go: by hand.
double fastest_change_s(const AxisTask& task) {
  const AxisBounds& b = task.bounds;
  const double side = task.end_speed >= coasting_speed(task.start, b.jerk) ? 1 : -1;
  const double bound = side > 0 ? b.acceleration_max : -b.acceleration_min, a = side * task.start.acceleration;
  const double change = side * (task.end_speed - task.start.speed), square = b.jerk * change + a * a / 2;
  if (a <= bound && square <= bound * bound) return (2 * std::sqrt(std::max(0.0, square)) - a) / b.jerk;
  const double push = std::abs(bound - a) / b.jerk, gained = push * (a + bound) / 2;
  return push + (change - gained - bound * bound / (2 * b.jerk)) / bound + bound / b.jerk;
}

AxisTask mirrored(const AxisTask& task) {
  const AxisBounds& b = task.bounds;
  return {{-task.start.position, -task.start.speed, -task.start.acceleration},
          -task.end_position,
          -task.end_speed,
          {-b.speed_max, -b.speed_min, -b.acceleration_max, -b.acceleration_min, b.jerk}};
}

TEST(Online, KnownDurations) {
  const AxisBounds bounds = AxisBounds::symmetric(1, 1, 1);
  const auto duration = [&](const AxisTask& task) {
    AxisProfile profile;
    return plan_positions(std::span(&task, 1), {}, std::span(&profile, 1)).value();
  };
  EXPECT_NEAR(duration({{}, 1, 0, bounds}), 4 * std::cbrt(0.5), 1e-14);                      // jerk alone
  EXPECT_NEAR(duration({{}, 10, 0, bounds}), 10 + 1 + 1, 1e-14);                             // up to the speed bound
  EXPECT_NEAR(duration({{0, 0.5, 0}, 3, 0.5, AxisBounds::symmetric(0.5, 1, 1)}), 6, 1e-14);  // at it all the way
  EXPECT_NEAR(duration({{0, 1, 0}, 1, 0, bounds}), 2, 1e-14);                                // just the stop
  EXPECT_NEAR(duration({{}, -1, 0, {-4, 4, -2, 2, 1e9}}), 2 * std::sqrt(0.5), 1e-8);         // acceleration alone
  EXPECT_NEAR(duration({{}, 1, 0, {-9, 9, -1, 2, 1e9}}), std::sqrt(3), 1e-8);                // braking half as hard
  EXPECT_EQ(duration({{1, 0, 0}, 1, 0, bounds}), 0);
}

TEST(Online, AnyNumberOfAxesEndsTogetherWithinItsBounds) {
  Random random(1);
  for (int i = 0; i < 8'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Tasks tasks = draw(random, 1 + random.below(kMostTasks));
    Profiles profiles(tasks.size());
    const auto duration = plan_positions(tasks, {}, profiles);
    ASSERT_TRUE(duration) << text(duration.error());
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      SCOPED_TRACE(k);
      EXPECT_LE(profiles[k].duration_s(), *duration * (1 + 1e-12));
      EXPECT_GE(profiles[k].duration_s(), *duration * (1 - 1e-12) - (tasks[k].end_speed == 0 ? 21e-9 : 0));
      expect_end(profiles[k], *duration, tasks[k]);
      expect_limits(profiles[k], tasks[k].bounds);
    }
  }
}

TEST(Online, AloneEachIsAtLeastAsFast) {
  Random random(2);
  for (int i = 0; i < 3'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Tasks tasks = draw(random, 4);
    Profiles profiles(tasks.size());
    const double together = plan_positions(tasks, {}, profiles).value();
    const double longest = plan_positions(tasks, {.synchronization = Synchronization::kNone}, profiles).value();
    EXPECT_LE(longest, together * (1 + 1e-12));
    double found = 0;
    for (std::size_t k = 0; k < tasks.size(); ++k) {
      found = std::max(found, profiles[k].duration_s());
      expect_end(profiles[k], profiles[k].duration_s(), tasks[k]);
    }
    EXPECT_NEAR(found, longest, 1e-12 * longest);
  }
}

// Bellman: what is left of an optimal motion is optimal. So planning anew in every tick gives the same motion.
TEST(Online, PlannedAnewOnTheWayItTakesTheRest) {
  Random random(3);
  for (int i = 0; i < 20'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    AxisTask task = draw_task(random);
    AxisProfile profile;
    const double duration = plan_positions(std::span(&task, 1), {}, std::span(&profile, 1)).value();
    const double t = random.uniform() * duration;
    task.start = profile.at(t);
    const double rest = plan_positions(std::span(&task, 1), {}, std::span(&profile, 1)).value();
    EXPECT_NEAR(t + rest, duration, 1e-6 * (1 + duration));
  }
}

TEST(Online, MirroredTasksGiveMirroredMotions) {
  Random random(4);
  for (int i = 0; i < 10'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Tasks tasks = draw(random, 2), other{mirrored(tasks[0]), mirrored(tasks[1])};
    Profiles a(2), b(2);
    const double duration = plan_positions(tasks, {}, a).value();
    ASSERT_NEAR(plan_positions(other, {}, b).value(), duration, 1e-12 * duration);
    for (const double share : {0.1, 0.35, 0.5, 0.8}) {
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(a[k].at(share * duration).position, -b[k].at(share * duration).position, kTight);
      }
    }
  }
}

TEST(Online, StartsBeyondTheirBoundsComeBackAtOnce) {
  const AxisBounds bounds{-1, 2, -4, 3, 100};
  AxisProfile profile;
  const auto plan = [&](const AxisPoint& start) {
    const AxisTask task{start, 5, 0, bounds};
    ASSERT_TRUE(plan_positions(std::span(&task, 1), {}, std::span(&profile, 1)));
    expect_end(profile, profile.duration_s(), task);
    expect_limits(profile, bounds);
  };
  plan({0, 3, 0});  // brakes with 4 until the speed is 2
  EXPECT_NEAR(profile.begin_s(1), 0.04, kTight);
  EXPECT_NEAR(profile.begin(2).speed, 2, kTight);
  EXPECT_NEAR(profile.begin_s(2), 0.04 + (1 - 0.08) / 4, kTight);
  plan({0, 0, -6});  // lets go of it with all jerk
  EXPECT_NEAR(profile.begin_s(1), 0.02, kTight);
  EXPECT_EQ(profile.begin(1).acceleration, -4);
  plan({0, -2, 0});  // the other way
  EXPECT_NEAR(profile.begin(2).speed, -1, kTight);
  EXPECT_EQ(profile.begin(2).acceleration, 3);
}

TEST(Online, OnALineIsStraight) {
  Random random(5);
  int lines = 0, too_fast = 0;
  for (int i = 0; i < 2'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const std::size_t axes = 1 + random.below(7);
    AxisTask line = draw_task(random, i % 2 == 0 ? 0 : 0.02);
    line.end_position = line.start.position + (random.below(2) == 0 ? 2 : -2);
    const double way = line.end_position - line.start.position;
    std::vector<double> shares;
    Tasks tasks;
    for (std::size_t k = 0; k < axes; ++k) {
      const double share = k == 0 ? 1 : random.uniform(-1, 1), from = k == 0 ? line.start.position : 0;
      AxisTask task = draw_task(random);
      task.start = {from, share * line.start.speed, share * line.start.acceleration};
      task.end_position = from + share * way;
      task.end_speed = 0;
      shares.push_back(share), tasks.push_back(task);
    }
    Profiles profiles(axes), others(axes);
    const auto duration = plan_positions(tasks, {.synchronization = Synchronization::kPhase}, profiles);
    ASSERT_TRUE(duration);
    // In motion the common jerk may be too small to keep an axis inside its bounds: then it is no line.
    double jerk = line.bounds.jerk, fastest = 0;
    for (std::size_t k = 0; k < axes; ++k) jerk = std::min(jerk, tasks[k].bounds.jerk / std::abs(shares[k]));
    const double coasting = coasting_speed(line.start, jerk);
    for (std::size_t k = 0; k < axes; ++k) {
      const double most = coasting * shares[k] > 0 ? tasks[k].bounds.speed_max : -tasks[k].bounds.speed_min;
      fastest = std::max(fastest, std::abs(coasting * shares[k]) / most);
    }
    const bool straight = fastest <= 1;
    ++(straight ? lines : too_fast);
    for (std::size_t k = 0; k < axes; ++k) {
      expect_end(profiles[k], *duration, tasks[k]);
      expect_limits(profiles[k], tasks[k].bounds);
      if (i % 2 == 0) {
        EXPECT_GE(*duration, plan_positions(tasks, {}, others).value() * (1 - 1e-12));
      }
      for (double t = 0; straight && t < *duration; t += *duration / 17) {
        EXPECT_NEAR(profiles[k].at(t).position - tasks[k].start.position,
                    shares[k] * (profiles[0].at(t).position - line.start.position), kTight);
      }
    }
  }
  EXPECT_GT(lines, 1'000);
  EXPECT_GT(too_fast, 0);
}

TEST(Online, StopsOnALine) {
  const AxisBounds bounds = AxisBounds::symmetric(2, 5, 50);
  const Tasks tasks{{{1, 1, 2}, 0, 0, bounds}, {{0, -0.5, -1}, 0, 0, bounds}, {{0, 0, 0}, 0, 0, bounds}};
  Profiles profiles(3);
  const double duration = plan_speeds(tasks, {.synchronization = Synchronization::kPhase}, profiles).value();
  EXPECT_NEAR(duration, fastest_change_s(tasks[0]), kTight);
  for (double t = 0; t <= duration; t += duration / 13) {
    EXPECT_NEAR(profiles[1].at(t).position, -0.5 * (profiles[0].at(t).position - 1), kTight);
    EXPECT_EQ(profiles[2].at(t).position, 0);
  }
}

TEST(Online, NotOnALineItEndsTogether) {
  Tasks tasks{{{0, 0.5, 0}, 1, 0, AxisBounds::symmetric(1, 5, 50)},
              {{0, -0.5, 0}, 1, 0, AxisBounds::symmetric(1, 5, 50)}};
  Profiles a(2), b(2);
  EXPECT_EQ(plan_positions(tasks, {.synchronization = Synchronization::kPhase}, a).value(),
            plan_positions(tasks, {}, b).value());
}

TEST(Online, KeepsToTheGridAndTheLeastDuration) {
  Random random(6);
  for (int i = 0; i < 2'000; ++i) {
    const Tasks tasks = draw(random, 3);
    Profiles profiles(3);
    const double free = plan_positions(tasks, {}, profiles).value();
    const double duration = plan_positions(tasks, {.least_s = 0.5, .grid_s = 0.004}, profiles).value();
    EXPECT_GE(duration, std::max(0.5, free) - 1e-12);
    EXPECT_NEAR(std::remainder(duration, 0.004), 0, 1e-9);
    for (std::size_t k = 0; k < 3; ++k) expect_end(profiles[k], duration, tasks[k]);
  }
}

TEST(Online, ReachesSpeedsTogetherInTheShortestTime) {
  Random random(7);
  for (int i = 0; i < 10'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Tasks tasks = draw(random, 3);
    Profiles profiles(3);
    const auto synchronization = i % 2 == 0 ? Synchronization::kTime : Synchronization::kNone;
    const double duration = plan_speeds(tasks, {.synchronization = synchronization}, profiles).value();
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double expected = fastest_change_s(tasks[k]);
      longest = std::max(longest, expected);
      EXPECT_GE(profiles[k].duration_s(), expected * (1 - kTight));
      EXPECT_LE(profiles[k].duration_s(),
                (synchronization == Synchronization::kNone ? expected : duration) * (1 + kTight));
      EXPECT_NEAR(profiles[k].end().speed, tasks[k].end_speed, kTight);
      EXPECT_EQ(profiles[k].end().acceleration, 0);
      expect_limits(profiles[k], tasks[k].bounds);
    }
    EXPECT_NEAR(duration, longest, kTight * (1 + longest));
  }
}

TEST(Online, AllocatesNothing) {
  Random random(8);
  for (const Synchronization synchronization :
       {Synchronization::kTime, Synchronization::kPhase, Synchronization::kNone}) {
    const Tasks tasks = draw(random, kMostTasks);
    Profiles profiles(kMostTasks);
    bool planned = false;
    EXPECT_EQ(test_allocations::allocations_in([&] {
                planned = plan_positions(tasks, {.synchronization = synchronization}, profiles) &&
                          plan_speeds(tasks, {.synchronization = synchronization, .least_s = 1}, profiles);
              }),
              0U);
    EXPECT_TRUE(planned);
  }
  Profiles seen;
  EXPECT_EQ(test_allocations::allocations_in([&] { seen.resize(1); }), 1U);
}

TEST(Online, SaysWhatIsWrong) {
  const AxisTask good{{0, 0, 0}, 1, 0, AxisBounds::symmetric(1, 2, 10)};
  const auto error = [](const Tasks& tasks, const OnlineOptions& options = {}, std::size_t profiles = 1) {
    Profiles made(profiles);
    const auto position = plan_positions(tasks, options, made);
    return position ? std::string("none") : std::string(text(position.error()));
  };
  const auto with = [&](auto change) {
    AxisTask task = good;
    change(task);
    return Tasks{task};
  };
  EXPECT_EQ(error({good}), "none");
  EXPECT_EQ(error({}, {}, 0), text(OnlineError::kCount));
  EXPECT_EQ(error({good}, {}, 2), text(OnlineError::kCount));
  EXPECT_EQ(error(Tasks(17, good), {}, 17), text(OnlineError::kCount));
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error(with([&](AxisTask& t) { t.start.acceleration = nan; })), text(OnlineError::kNotFinite));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.bounds.jerk = infinite; })), text(OnlineError::kNotFinite));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.end_position = -infinite; })), text(OnlineError::kNotFinite));
  EXPECT_EQ(error({good}, {.least_s = nan}), text(OnlineError::kNotFinite));
  EXPECT_EQ(error({good}, {.grid_s = -1}), text(OnlineError::kBounds));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.bounds.speed_min = 0; })), text(OnlineError::kBounds));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.bounds.acceleration_max = -1; })), text(OnlineError::kBounds));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.bounds.jerk = 0; })), text(OnlineError::kBounds));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.end_speed = 1.1; })), text(OnlineError::kEndSpeed));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.end_position = 1e7; })), text(OnlineError::kTooLong));
  EXPECT_EQ(error(with([&](AxisTask& t) { t.start.position = 1e300; })), text(OnlineError::kTooLong));
  EXPECT_EQ(error({good}, {.least_s = 1e9}), text(OnlineError::kTooLong));
}

// None of these is a number that only a lucky formula survives.
TEST(Online, SurvivesEveryCombinationOfExtremes) {
  const double values[] = {0, 1e-300, 1e-12, 1, 1e12, 1e300};
  AxisProfile profile;
  int planned = 0;
  for (const double speed : values) {
    for (const double acceleration : values) {
      for (const double jerk : values) {
        for (const double way : values) {
          for (const double start : {0.0, speed, -1e6 * speed}) {
            const AxisTask task{{0, start, acceleration}, way, speed, AxisBounds::symmetric(speed, acceleration, jerk)};
            const auto duration = plan_positions(std::span(&task, 1), {}, std::span(&profile, 1));
            if (!duration) continue;
            ++planned;
            EXPECT_TRUE(std::isfinite(*duration));
            EXPECT_TRUE(std::isfinite(profile.end().position));
          }
        }
      }
    }
  }
  EXPECT_GT(planned, 300);
}

}  // namespace
}  // namespace pons::motion
