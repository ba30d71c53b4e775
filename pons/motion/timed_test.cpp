#include "pons/motion/timed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/motion/test_plans.hpp"

namespace pons::motion {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr Time kAt{1'234'567ns};

AxisVector one(double value) { return AxisVector::Constant(1, value); }
AxisVector two(double a, double b) { return (AxisVector(2) << a, b).finished(); }

AxisLimits limits(Eigen::Index axes = 1) {
  return {AxisVector::Constant(axes, -3), AxisVector::Constant(axes, 3),   AxisVector::Constant(axes, 2),
          AxisVector::Constant(axes, 15), AxisVector::Constant(axes, 300), AxisVector::Constant(axes, 100)};
}

double at(const Trajectory& way, double t_s) { return sample(way, kAt + from_s(t_s), 1).position[0]; }

// ∫ jerk² dt of one axis.
double roughness(const Trajectory& way) {
  double sum = 0;
  for (const Segment& segment : way) {
    const auto& c = segment.coefficients[0];
    constexpr int kParts = 200;
    const double h = to_s(segment.duration) / kParts;
    for (int i = 0; i < kParts; ++i) {
      const double t = (i + 0.5) * h, jerk = 6 * c[3] + t * (24 * c[4] + t * 60 * c[5]);
      sum += jerk * jerk * h;
    }
  }
  return sum;
}

// Of axis 0, by its extremes in [from, to].
std::pair<double, double> range(const Trajectory& way, double from_s, double to_s) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (int i = 0; i <= 1000; ++i) {
    const double q = at(way, from_s + (to_s - from_s) * i / 1000);
    low = std::min(low, q), high = std::max(high, q);
  }
  return {low, high};
}

TEST(TimedTest, IsAtEachPointAtItsTimeWithoutAJumpInAcceleration) {
  Random random(7);
  for (const Shape shape : {Shape::kSmooth, Shape::kBetween}) {
    for (int round = 0; round < 50; ++round) {
      const AxisVector start = two(random.uniform(-1, 1), random.uniform(-1, 1));
      std::vector<TimedPoint> points;
      double t = 0;
      for (int k = 0; k < 12; ++k) {
        t += random.uniform(0.05, 1.5);
        points.push_back({t, two(random.uniform(-1, 1), random.uniform(-1, 1)), {}});
        if (k % 4 == 1) points.back().speed = two(random.uniform(-1, 1), random.uniform(-1, 1));
      }
      const auto way = move_in_time(start, kAt, points, shape);
      ASSERT_TRUE(way) << way.error().line();
      ASSERT_EQ(way->size(), points.size());
      AxisState before = at_rest(start), after = before;
      for (std::size_t k = 0; k < way->size(); ++k) {
        sample((*way)[k], (*way)[k].start, after);
        EXPECT_TRUE(after.position.isApprox(before.position, 1e-9));
        EXPECT_LT((after.speed - before.speed).cwiseAbs().maxCoeff(), 1e-9);
        EXPECT_LT((after.acceleration - before.acceleration).cwiseAbs().maxCoeff(), 1e-6);
        sample((*way)[k], (*way)[k].end(), before);
        EXPECT_EQ((*way)[k].end(), kAt + from_s(points[k].time_s));
        EXPECT_LT((before.position - points[k].position).cwiseAbs().maxCoeff(), 1e-9);
        if (points[k].speed) {
          EXPECT_LT((before.speed - *points[k].speed).cwiseAbs().maxCoeff(), 1e-8);
        }
      }
      EXPECT_LT(before.speed.norm() + before.acceleration.norm(), 1e-6);
    }
  }
}

TEST(TimedTest, OneLegIsTheQuinticFromRestToRest) {
  const auto way = move_in_time(one(0.2), kAt, {{{2, one(1.2), {}}}}, Shape::kBetween);
  ASSERT_TRUE(way);
  for (const double share : {0.1, 0.25, 0.5, 0.8}) {
    const double u = share * share * share * (10 + share * (6 * share - 15));
    EXPECT_NEAR(at(*way, 2 * share), 0.2 + u, 1e-12);
  }
}

// Any other speed at a point makes it rougher.
TEST(TimedTest, ChoosesTheSpeedsOfLeastJerk) {
  const std::vector<TimedPoint> points{{1, one(0.3), {}}, {1.6, one(0.9), {}}, {2.9, one(1.1), {}}};
  const auto way = move_in_time(one(0), kAt, points, Shape::kSmooth);
  ASSERT_TRUE(way);
  const double least = roughness(*way);
  for (const std::size_t k : {0U, 1U}) {
    const double speed = sample(*way, (*way)[k].end(), 1).speed[0];
    for (const double off : {-0.05, 0.05}) {
      std::vector<TimedPoint> other = points;
      other[k].speed = one(speed + off);
      const auto rougher = move_in_time(one(0), kAt, other, Shape::kSmooth);
      ASSERT_TRUE(rougher);
      EXPECT_GT(roughness(*rougher), 1.0001 * least) << k << " " << off;
    }
    std::vector<TimedPoint> same = points;
    same[k].speed = one(speed);
    EXPECT_NEAR(roughness(*move_in_time(one(0), kAt, same, Shape::kSmooth)), least, 1e-6 * least);
  }
}

// From places alone: as MoveIt and others sample them.
TEST(TimedTest, FollowsWhatWasSampledFromASmoothMotion) {
  const auto smooth = [](double t) {
    const double s = t / 4, away = s * (1 - s);
    return 0.6 * (s - std::sin(2 * std::numbers::pi * s) / (2 * std::numbers::pi)) +
           20 * away * away * away * std::sin(9 * s);
  };
  std::vector<TimedPoint> points;
  for (int k = 1; k <= 40; ++k) points.push_back({0.1 * k, one(smooth(0.1 * k)), {}});
  for (const Shape shape : {Shape::kSmooth, Shape::kBetween}) {
    const auto way = move_in_time(one(0), kAt, points, shape);
    ASSERT_TRUE(way);
    double off = 0;
    for (double t = 0; t < 4; t += 0.01) off = std::max(off, std::abs(at(*way, t) - smooth(t)));
    EXPECT_LT(off, shape == Shape::kSmooth ? 2e-4 : 2e-3);
  }
}

// Two things that the smoothest motion does not do: stay where two points are the same, and not swing past a point
// where it gets slow or turns.
TEST(TimedTest, BetweenPointsNoAxisGoesBeyondThem) {
  const std::vector<TimedPoint> points{{0.5, one(0.8), {}}, {1.5, one(0.8), {}},  {2.5, one(0.81), {}},
                                       {2.8, one(1.6), {}}, {3.0, one(1.61), {}}, {4.0, one(0.2), {}},
                                       {4.4, one(0.1), {}}};
  const auto smooth = move_in_time(one(0), kAt, points, Shape::kSmooth);
  const auto between = move_in_time(one(0), kAt, points, Shape::kBetween);
  ASSERT_TRUE(smooth && between);
  EXPECT_GT(range(*smooth, 0.5, 1.5).second, 0.82) << "or the points are no test";
  double from_s = 0, from = 0;
  for (const TimedPoint& point : points) {
    const double to = point.position[0], slack = 0.0021 * std::abs(to - from) + 1e-9;
    const auto [low, high] = range(*between, from_s, point.time_s);
    EXPECT_GE(low, std::min(from, to) - slack) << "to " << point.time_s << " s";
    EXPECT_LE(high, std::max(from, to) + slack) << "to " << point.time_s << " s";
    from_s = point.time_s, from = to;
  }
  EXPECT_EQ(range(*between, 0.5, 1.5), std::pair(0.8, 0.8));
}

TEST(TimedTest, WhateverThePointsBetweenThemMeansBetweenThem) {
  Random random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<TimedPoint> points;
    double t = 0, q = 0;
    for (int k = 0; k < 8; ++k) {
      const double step = random.uniform(-1, 1);
      t += random.uniform(0.1, 1), q += step * std::abs(step);
      points.push_back({t, one(q), {}});
    }
    const auto way = move_in_time(one(0), kAt, points, Shape::kBetween);
    ASSERT_TRUE(way);
    double from_s = 0, from = 0;
    for (const TimedPoint& point : points) {
      const double to = point.position[0], slack = 0.0021 * std::abs(to - from) + 1e-9;
      const auto [low, high] = range(*way, from_s, point.time_s);
      EXPECT_GE(low, std::min(from, to) - slack);
      EXPECT_LE(high, std::max(from, to) + slack);
      from_s = point.time_s, from = to;
    }
  }
}

TEST(TimedTest, RefusesByNameWhatIsNoMotion) {
  const auto says = [](const AxisVector& start, const std::vector<TimedPoint>& points) {
    const auto way = move_in_time(start, kAt, points, Shape::kBetween);
    return way ? std::string() : way.error().line();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(says(one(0), {}), HasSubstr("no points"));
  EXPECT_THAT(says(one(nan), {{1, one(0), {}}}), HasSubstr("the start is not finite"));
  EXPECT_THAT(says(one(0), {{1, one(0), {}}, {2, two(0, 0), {}}}), HasSubstr("point 2: position or speed"));
  EXPECT_THAT(says(one(0), {{1, one(nan), {}}}), HasSubstr("point 1: position or speed"));
  EXPECT_THAT(says(one(0), {{1, one(0), one(nan)}}), HasSubstr("point 1: position or speed"));
  EXPECT_THAT(says(one(0), {{0, one(0), {}}}), HasSubstr("point 1: its time, 0 s"));
  EXPECT_THAT(says(one(0), {{1, one(0), {}}, {1.0005, one(1), {}}}), HasSubstr("point 2: its time, 1.0005 s"));
  EXPECT_THAT(says(one(0), {{nan, one(0), {}}}), HasSubstr("point 1: its time"));
  EXPECT_THAT(says(one(0), {{1, one(0), one(0.1)}}), HasSubstr("point 1: it ends with a speed"));
}

// ---- limits ----

TEST(TimedTest, SaysWhichLegOfWhichAxisIsBeyondWhichLimit) {
  const std::vector<TimedPoint> points{{2, two(0.5, 0.2), {}}, {2.4, two(0.6, 1.2), {}}, {4, two(0.6, 1.2), {}}};
  const auto way = move_in_time(two(0, 0), kAt, points, Shape::kBetween);
  ASSERT_TRUE(way);
  const std::vector<Excess> found = excesses(*way, points, limits(2));
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().point, 1U);
  EXPECT_EQ(found.front().axis, 1);
  EXPECT_EQ(name(found.front().of), "speed");
  EXPECT_GT(found.front().use, 1.5);
  AxisLimits wide = limits(2);
  wide.speed_rad_s *= 100, wide.acceleration_rad_s2 *= 100, wide.jerk_rad_s3 *= 100;
  EXPECT_TRUE(excesses(*way, points, wide).empty());
  wide.position_max[0] = 0.55;
  ASSERT_EQ(excesses(*way, points, wide).size(), 2U);
  EXPECT_EQ(name(excesses(*way, points, wide).front().of), "position");
  EXPECT_EQ(excesses(*way, points, wide).front().point, 1U);
  EXPECT_EQ(excesses(*way, points, wide).front().axis, 0);
}

InTime from_rest(const AxisVector& start) {
  return [start](std::span<const TimedPoint> points) { return move_in_time(start, kAt, points, Shape::kBetween); };
}

// For one leg that is the quickest of this form: no more than the limits ask for.
TEST(TimedTest, GivesALegTheTimeThatItsLimitsAskFor) {
  const auto given = give_time({{0.1, one(1.0), {}}}, from_rest(one(0)), limits());
  ASSERT_TRUE(given) << given.error().line();
  EXPECT_NEAR(given->back().time_s, std::max({1.875 / 2, std::sqrt(5.7735 / 15), std::cbrt(60.0 / 300)}), 1e-4);
  auto less = *given;
  stretch(less, 0.999);
  EXPECT_FALSE(excesses(*from_rest(one(0))(less), less, limits()).empty());
}

TEST(TimedTest, GivesTimeUntilAllLimitsAreKeptAndTakesNone) {
  Random random(11);
  for (int round = 0; round < 50; ++round) {
    std::vector<TimedPoint> points;
    double t = 0;
    for (int k = 0; k < 10; ++k) {
      t += random.uniform(0.02, 1.0);
      points.push_back({t, two(random.uniform(-1, 1), random.uniform(-1, 1)), {}});
      if (k == 4) points.back().speed = two(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2));
    }
    const auto given = give_time(points, from_rest(two(0, 0)), limits(2));
    ASSERT_TRUE(given) << given.error().line();
    EXPECT_TRUE(excesses(*from_rest(two(0, 0))(*given), *given, limits(2)).empty());
    double before = 0, before_given = 0;
    for (std::size_t k = 0; k < points.size(); ++k) {
      EXPECT_GE((*given)[k].time_s - before_given, points[k].time_s - before - 1e-9);
      EXPECT_EQ((*given)[k].position, points[k].position);
      before = points[k].time_s, before_given = (*given)[k].time_s;
    }
    EXPECT_LE(given->back().time_s, 40 * points.back().time_s);
    EXPECT_LE(given->at(4).speed->norm(), points[4].speed->norm());
  }
}

// Corners of seven axes, and a quarter of their accelerations.
std::vector<AxisVector> corners(int sides) {
  AxisVector one(7), other(7);
  one << 0.8, 0.3, -0.4, 0.5, 0.2, -0.6, 0.9;
  other << -0.3, 0.2, 0.5, 0.3, -0.6, 0.2, -0.5;
  return laps(AxisVector::Zero(7), one, other, sides);
}
AxisVector gently() { return 0.25 * limits(7).acceleration_rad_s2; }

// What was planned without a thought of jerk: the last interval may be however short, and accelerations step anywhere.
TEST(TimedTest, APlanThatIsSampledTakesHardlyLonger) {
  for (const double share : {0.1, 0.5, 1.0}) {
    for (const double last_s : {0.001, 0.004, 0.010, 0.020, 0.046, 0.090}) {
      const auto plan = plan_that_ends_after(last_s, corners(2), share * limits(7).speed_rad_s, share * gently());
      std::vector<TimedPoint> points = plan.points();
      ASSERT_NEAR(points.back().time_s - points[points.size() - 2].time_s, last_s, 1e-6);
      points.erase(points.begin());
      const auto given = give_time(points, from_rest(AxisVector::Zero(7)), limits(7));
      ASSERT_TRUE(given) << given.error().line();
      EXPECT_LT(given->back().time_s - points.back().time_s, 0.04) << share << ", " << last_s;
    }
  }
}

// A minute of them, ten a second.
TEST(TimedTest, OfManyPointsItKeepsThoseThatLeadItPastAll) {
  constexpr double kWithin = 0.001;
  const auto points = SampledPlan(corners(15), 0.1 * limits(7).speed_rad_s, 0.1 * gently()).points();
  ASSERT_GT(points.size(), 550U);
  const auto few = thinned(points, Shape::kBetween, kWithin, 200);
  ASSERT_TRUE(few) << few.error().line();
  EXPECT_LT(few->size(), 150U);
  EXPECT_EQ(few->front().time_s, 0);
  EXPECT_EQ(few->back().time_s, points.back().time_s);
  const auto way = from_rest(AxisVector::Zero(7))(std::span(*few).subspan(1));
  ASSERT_TRUE(way) << way.error().line();
  for (const TimedPoint& point : points) {
    const AxisVector is = sample(*way, kAt + from_s(point.time_s), 7).position;
    EXPECT_LE((is - point.position).cwiseAbs().maxCoeff(), kWithin + 1e-9) << point.time_s;
  }
  const auto fewer = thinned(points, Shape::kBetween, kWithin, few->size() / 2);
  ASSERT_FALSE(fewer);
  EXPECT_THAT(fewer.error().line(), HasSubstr("points are needed to pass each within 0.001"));
  EXPECT_THAT(thinned(std::span(points).subspan(1), Shape::kBetween, kWithin, 200).error().line(),
              HasSubstr("begin with where it rests"));
}

TEST(TimedTest, WhatTimeCannotMendIsSaid) {
  // With such a speed it must swing past the limit.
  const auto given = give_time({{1, one(2.95), one(1.5)}, {2, one(2.9), {}}}, from_rest(one(2.5)), limits());
  ASSERT_FALSE(given);
  EXPECT_THAT(given.error().line(), HasSubstr("point 2: axis 1 leaves its position limits"));
}

}  // namespace
}  // namespace pons::motion
