#include "pons/motion/motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/motion/axis_plan.hpp"

namespace pons::motion {
namespace {

using namespace std::chrono_literals;

constexpr Time kAt{1'234'567ns};

AxisLimits arm_limits(Eigen::Index axes = 6) {
  return {AxisVector::Constant(axes, -6.28), AxisVector::Constant(axes, 6.28), AxisVector::Constant(axes, 3.14),
          AxisVector::Constant(axes, 20),    AxisVector::Constant(axes, 400),  AxisVector::Constant(axes, 100)};
}

AxisVector draw(Random& random, Eigen::Index axes, double size) {
  AxisVector result(axes);
  for (Eigen::Index i = 0; i < axes; ++i) result[i] = random.uniform(-size, size);
  return result;
}

Waypoint rest(const AxisVector& position) { return {position, AxisVector::Zero(position.size())}; }

// No gap in time; position and speed to rounding, acceleration to ten nanoseconds of jerk.
void expect_continuous(const Trajectory& trajectory, const AxisState& start, const AxisLimits& limits) {
  const Eigen::Index axes = start.position.size();
  AxisState before = start, after = start;
  for (std::size_t k = 0; k < trajectory.size(); ++k) {
    ASSERT_GT(trajectory[k].duration, 0ns);
    ASSERT_EQ(trajectory[k].start, k > 0 ? trajectory[k - 1].end() : kAt);
    sample(trajectory[k], trajectory[k].start, after);
    for (Eigen::Index i = 0; i < axes; ++i) {
      ASSERT_NEAR(after.position[i], before.position[i], 1e-8) << k;
      ASSERT_NEAR(after.speed[i], before.speed[i], 1e-8) << k;
      ASSERT_NEAR(after.acceleration[i], before.acceleration[i], 1e-8 * limits.jerk_rad_s3[i]) << k;
    }
    sample(trajectory[k], trajectory[k].end(), before);
  }
}

void expect_good(const Expected<Trajectory>& trajectory, const AxisState& start, const Waypoint& end,
                 const AxisLimits& limits) {
  ASSERT_TRUE(trajectory) << trajectory.error().line();
  ASSERT_FALSE(trajectory->empty());
  EXPECT_EQ(trajectory->front().start, kAt);
  expect_continuous(*trajectory, start, limits);
  const AxisState last = sample(*trajectory, trajectory->back().end(), start.position.size());
  EXPECT_LT((last.position - end.position).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((last.speed - end.speed).cwiseAbs().maxCoeff(), 1e-8);
  const LimitUse use = limit_use(*trajectory, limits);
  EXPECT_LE(use.worst(), 1 + 1e-9);
  EXPECT_TRUE(use.inside_position);
}

// A state from which the limits can be kept.
AxisState moving(Random& random, const AxisLimits& limits) {
  const Eigen::Index axes = limits.speed_rad_s.size();
  AxisState state{draw(random, axes, 3), draw(random, axes, 3.14), draw(random, axes, 20)};
  for (Eigen::Index i = 0; i < axes; ++i) {
    while (std::abs(coasting_speed({0, state.speed[i], state.acceleration[i]}, 400)) > 3.14) state.acceleration[i] /= 2;
  }
  return state;
}

TEST(Move, AnyStartAnyEndAllAxesTogether) {
  Random random(1);
  const AxisLimits limits = arm_limits();
  for (int i = 0; i < 5'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisState start = moving(random, limits);
    const Waypoint end{draw(random, 6, 3), draw(random, 6, random.below(2) != 0 ? 2 : 0)};
    expect_good(move(start, kAt, end, limits), start, end, limits);
  }
}

TEST(Move, RestToRestIsStraightAndAsFastAsTheSlowestAxis) {
  const AxisLimits limits = arm_limits(3);
  const AxisVector from = AxisVector::Zero(3), to = AxisVector{{1.5, -0.3, 0}};
  const auto trajectory = move(at_rest(from), kAt, rest(to), limits);
  expect_good(trajectory, at_rest(from), rest(to), limits);
  const double duration = to_s(trajectory->back().end() - kAt);
  EXPECT_NEAR(duration, 1.5 / 3.14 + 3.14 / 20 + 20.0 / 400, 1e-7);
  EXPECT_LE(trajectory->size(), 9U);
  for (double t = 0; t < duration; t += 0.01) {
    const AxisState state = sample(*trajectory, kAt + from_s(t), 3);
    EXPECT_NEAR(state.position[1], -0.2 * state.position[0], 1e-8);
    EXPECT_EQ(state.position[2], 0);
  }
}

TEST(Move, GoesOnFromAnyMomentOfAnotherMove) {
  Random random(2);
  const AxisLimits limits = arm_limits();
  AxisState state = at_rest(AxisVector::Zero(6));
  for (int i = 0; i < 2'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Waypoint end = rest(draw(random, 6, 3));
    const auto trajectory = move(state, kAt, end, limits);
    expect_good(trajectory, state, end, limits);
    if (!trajectory) break;
    state = sample(*trajectory, kAt + (trajectory->back().end() - kAt) / 3, 6);
  }
}

TEST(Move, StaysWhereItIs) {
  const AxisLimits limits = arm_limits();
  const AxisState start = at_rest(AxisVector::Constant(6, 0.5));
  expect_good(move(start, kAt, rest(start.position), limits), start, rest(start.position), limits);
}

TEST(Move, SaysWhatIsWrong) {
  const AxisLimits limits = arm_limits();
  const AxisState start = at_rest(AxisVector::Zero(6));
  const auto error = [&](const AxisState& from, const Waypoint& to, const AxisLimits& within) {
    const auto result = move(from, kAt, to, within);
    return result ? std::string("none") : result.error().line();
  };
  Waypoint far = rest(AxisVector::Zero(6));
  far.position[2] = 7;
  EXPECT_EQ(error(start, far, limits),
            "end: position 7 of axis 3 is not within [-6.28, 6.28]; plan within the robot's limits");
  Waypoint fast = rest(AxisVector::Ones(6));
  fast.speed[0] = -4;
  EXPECT_NE(error(start, fast, limits).find("speed -4 of axis 1"), std::string::npos);
  AxisState broken = start;
  broken.speed[1] = std::nan("");
  EXPECT_NE(error(broken, rest(AxisVector::Zero(6)), limits).find("start: speed nan of axis 2"), std::string::npos);
  AxisState doomed = start;
  doomed.speed[5] = 3.1;
  doomed.acceleration[5] = 19;
  EXPECT_NE(error(doomed, rest(AxisVector::Zero(6)), limits).find("the speed ahead"), std::string::npos);
  AxisLimits none = limits;
  none.jerk_rad_s3[0] = 0;
  EXPECT_NE(error(start, rest(AxisVector::Zero(6)), none).find("jerk limit"), std::string::npos);
  EXPECT_NE(error(start, rest(AxisVector::Zero(5)), limits).find("not 6"), std::string::npos);
  AxisState near = at_rest(AxisVector::Constant(6, 6.27));
  near.speed[3] = 3;
  EXPECT_NE(error(near, rest(AxisVector::Zero(6)), limits).find("axis 4 swings through"), std::string::npos);
}

TEST(MoveThrough, PassesTheViasFasterThanHalting) {
  Random random(3);
  const AxisLimits limits = arm_limits();
  std::vector<double> over;  // durations, of a halt at each via
  for (int i = 0; i < 1000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisState start = i % 2 == 0 ? at_rest(draw(random, 6, 2)) : moving(random, limits);
    const std::vector<AxisVector> vias{draw(random, 6, 2), draw(random, 6, 2)};
    const Waypoint end{draw(random, 6, 2), draw(random, 6, i % 3 == 0 ? 0.5 : 0)};
    const auto trajectory = move_through(start, kAt, vias, end, limits);
    expect_good(trajectory, start, end, limits);
    if (!trajectory) break;
    std::size_t passed = 0;
    for (const Segment& segment : *trajectory) {
      const AxisState state = sample(*trajectory, segment.start, 6);
      if (passed < 2 && (state.position - vias[passed]).cwiseAbs().maxCoeff() < 1e-7) ++passed;
    }
    EXPECT_EQ(passed, 2U);
    Duration halting{0};
    AxisState from = start;
    for (const Waypoint& stop_over : {rest(vias[0]), rest(vias[1]), end}) {
      const auto part = move(from, kAt, stop_over, limits);
      ASSERT_TRUE(part);
      halting += part->back().end() - kAt;
      from = at_rest(stop_over.position);
    }
    over.push_back(to_s(trajectory->back().end() - kAt) / to_s(halting));
  }
  // Vias anywhere, so most axes turn round at them, and the slowest must halt there in any case.
  std::ranges::sort(over);
  EXPECT_LT(over.back(), 0.99);
  EXPECT_LT(over[over.size() / 2], 0.93);
}

TEST(MoveThrough, AViaOnTheWayCostsLittle) {
  const AxisLimits limits = arm_limits(2);
  const AxisState start = at_rest(AxisVector::Zero(2));
  const Waypoint end = rest(AxisVector{{2, 0.5}});
  const auto straight = move(start, kAt, end, limits);
  const std::vector<AxisVector> vias{AxisVector{{0.4, 0.1}}, AxisVector{{1.6, 0.4}}};
  const auto through = move_through(start, kAt, vias, end, limits);
  ASSERT_TRUE(straight && through);
  const double direct = to_s(straight->back().end() - kAt), detour = to_s(through->back().end() - kAt);
  EXPECT_GE(detour, direct - 1e-8);
  EXPECT_LE(detour, 1.05 * direct);
}

// As a tool goes up and over: the vias near the ends. There the descent often ends in a longer motion than it began
// with.
TEST(MoveThrough, MoreEffortIsNeverLonger) {
  Random random(11);
  const AxisLimits limits = arm_limits();
  for (int i = 0; i < 1000; ++i) {
    const AxisState start = i % 2 == 0 ? at_rest(draw(random, 6, 2)) : moving(random, limits);
    const Waypoint end{draw(random, 6, 2), draw(random, 6, i % 3 == 0 ? 0.5 : 0)};
    const std::vector<AxisVector> vias{start.position + draw(random, 6, 0.3), end.position + draw(random, 6, 0.3)};
    const auto rough = move_through(start, kAt, vias, end, limits, Effort::kRough);
    const auto fine = move_through(start, kAt, vias, end, limits, Effort::kFine);
    ASSERT_EQ(rough.has_value(), fine.has_value());
    if (!rough) continue;
    EXPECT_LE(fine->back().end(), rough->back().end()) << i;
  }
}

TEST(MoveThrough, IsRepeatable) {
  Random random(5);
  const AxisLimits limits = arm_limits();
  const AxisState start = moving(random, limits);
  const std::vector<AxisVector> vias{draw(random, 6, 1)};
  const Waypoint end = rest(draw(random, 6, 1));
  const auto a = move_through(start, kAt, vias, end, limits), b = move_through(start, kAt, vias, end, limits);
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->size(), b->size());
  for (std::size_t k = 0; k < a->size(); ++k) EXPECT_EQ((*a)[k].coefficients, (*b)[k].coefficients);
}

TEST(Stop, ComesToRestWithinLimitsFromAnyMotion) {
  Random random(4);
  const AxisLimits limits = arm_limits();
  for (int i = 0; i < 5'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisState start = moving(random, limits);
    const auto trajectory = stop(start, kAt, limits);
    ASSERT_TRUE(trajectory);
    expect_good(trajectory, start, rest(sample(*trajectory, trajectory->back().end(), 6).position), limits);
    double slowest = 0;
    for (Eigen::Index k = 0; k < 6; ++k) {
      const AxisPoint point{0, start.speed[k], start.acceleration[k]};
      slowest = std::max(slowest, SpeedPlan(point, 0, AxisBounds::symmetric(3.14, 20, 400)).duration_s());
    }
    EXPECT_NEAR(to_s(trajectory->back().end() - kAt), slowest, 1e-6);
  }
}

TEST(LimitUse, FindsExtremesBetweenTheEnds) {
  Segment segment;
  segment.duration = 1s;
  segment.coefficients[0] = {0, 0, 0, 10, -15, 6};  // the minimum-jerk polynomial
  const LimitUse use = limit_use(std::span(&segment, 1), arm_limits(1));
  EXPECT_NEAR(use.speed, 1.875 / 3.14, 1e-12);
  EXPECT_NEAR(use.acceleration, 10 / std::sqrt(3.0) / 20, 1e-12);
  EXPECT_NEAR(use.jerk, 60.0 / 400, 1e-12);
  EXPECT_TRUE(use.inside_position);
  AxisLimits tight = arm_limits(1);
  tight.position_max[0] = 0.99;
  EXPECT_EQ(limit_use(std::span(&segment, 1), tight).worst(), 2);
}

// Pieces that cannot raise it are passed over, but not one that does so in its middle only.
TEST(LimitUse, SeesAMiddleBehindHigherEnds) {
  std::vector<Segment> segments(2);
  for (Segment& segment : segments) segment.duration = 1s;
  segments[0].coefficients[0] = {0, 1, 0.5};             // speed from 1 to 2, acceleration 1
  segments[1].coefficients[0] = {0, 0, 0, 20, -30, 12};  // twice the minimum-jerk polynomial
  const LimitUse use = limit_use(segments, arm_limits(1));
  EXPECT_NEAR(use.speed, 3.75 / 3.14, 1e-12);
  EXPECT_NEAR(use.acceleration, 20 / std::sqrt(3.0) / 20, 1e-12);
  segments[1].coefficients[0] = {6, 2, -2};  // 6.5 half-way
  EXPECT_FALSE(limit_use(segments, arm_limits(1)).inside_position);
}

TEST(LimitUse, IsWhatDenseSamplingSees) {
  Random random(12);
  constexpr Eigen::Index kAxes = 3;
  const AxisLimits limits = arm_limits(kAxes);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    std::vector<Segment> segments(8);
    LimitUse seen;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      Segment& segment = segments[k];
      segment.duration = from_s(random.uniform(0.005, 1));
      const int degree = 3 + static_cast<int>(random.below(3));
      for (std::size_t axis = 0; axis < kAxes; ++axis) {
        for (int c = 0; c <= degree; ++c) segment.coefficients[axis][static_cast<std::size_t>(c)] = random.normal();
        const auto& c = segment.coefficients[axis];
        const auto raise = [](double& use, double value, double limit) {
          use = std::max(use, std::abs(value) / limit);
        };
        for (int n = 0; n <= 400; ++n) {
          const double t = to_s(segment.duration) * n / 400;
          const double position = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
          seen.inside_position = seen.inside_position && std::abs(position) <= 6.28;
          raise(seen.speed, c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5]))), 3.14);
          raise(seen.acceleration, 2 * c[2] + t * (6 * c[3] + t * (12 * c[4] + t * 20 * c[5])), 20);
          raise(seen.jerk, 6 * c[3] + t * (24 * c[4] + t * 60 * c[5]), 400);
        }
      }
    }
    const LimitUse use = limit_use(segments, limits);
    for (const auto& [exact, sampled] :
         {std::pair{use.speed, seen.speed}, std::pair{use.acceleration, seen.acceleration},
          std::pair{use.jerk, seen.jerk}}) {
      EXPECT_GE(exact, sampled * (1 - 1e-12));
      EXPECT_LE(exact, sampled * (1 + 1e-4) + 1e-6);
    }
    EXPECT_EQ(use.inside_position, seen.inside_position);
  }
}

TEST(Sample, HoldsBeforeAndAfter) {
  const AxisLimits limits = arm_limits(1);
  const auto trajectory = move(at_rest(AxisVector::Zero(1)), kAt, rest(AxisVector::Ones(1)), limits);
  ASSERT_TRUE(trajectory);
  EXPECT_EQ(sample(*trajectory, Time{}, 1).position[0], 0);
  const AxisState after = sample(*trajectory, trajectory->back().end() + 1s, 1);
  EXPECT_NEAR(after.position[0], 1, 1e-9);
  EXPECT_EQ(after.acceleration[0], 0);
}

// Vias that leave an axis where it is while it moves: the hardest to wait for.
TEST(MoveThrough, SeamsMeetFromAnyMovingStart) {
  const Eigen::Index axes = 6;
  AxisLimits limits;
  limits.position_max = AxisVector::Constant(axes, 6.28);
  limits.position_min = -limits.position_max;
  limits.speed_rad_s = AxisVector::Constant(axes, 3.0);
  limits.acceleration_rad_s2 = AxisVector::Constant(axes, 19);
  limits.jerk_rad_s3 = AxisVector::Constant(axes, 390);
  Random random(1);
  for (int run = 0; run < 2000; ++run) {
    AxisState start{AxisVector(axes), AxisVector(axes), AxisVector(axes)};
    AxisVector via(axes), end(axes), end_speed(axes);
    for (Eigen::Index i = 0; i < axes; ++i) {
      start.position[i] = random.uniform(-2, 2);
      start.speed[i] = random.uniform(-1, 1);
      start.acceleration[i] = random.uniform(-18, 18);
      via[i] = start.position[i] + (random.uniform() < 0.5 ? 0.0 : random.uniform(-0.3, 0.3));
      end[i] = start.position[i] + random.uniform(-1.5, 1.5);
      end_speed[i] = random.uniform(-0.5, 0.5);
    }
    const auto way = move_through(start, Time(from_s(300)), std::vector{via}, {end, end_speed}, limits);
    ASSERT_TRUE(way) << "run " << run << ": " << way.error().line();
    AxisState before = start, after = start;
    for (std::size_t k = 0; k + 1 < way->size(); ++k) {
      pons::sample((*way)[k], (*way)[k].end(), before);
      pons::sample((*way)[k + 1], (*way)[k + 1].start, after);
      ASSERT_LT((before.position - after.position).cwiseAbs().maxCoeff(), 1e-6) << "run " << run << ", seam " << k;
      ASSERT_LT((before.speed - after.speed).cwiseAbs().maxCoeff(), 1e-5) << "run " << run << ", seam " << k;
    }
    ASSERT_LE(limit_use(*way, limits).worst(), 1 + 1e-6) << "run " << run;
  }
}

}  // namespace
}  // namespace pons::motion
