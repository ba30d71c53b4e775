#include "pons/motion/path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pons::motion {
namespace {

using ::testing::HasSubstr;

AxisLimits square(double half) {
  AxisLimits limits;
  limits.position_min = AxisVector::Constant(2, -half);
  limits.position_max = AxisVector::Constant(2, half);
  return limits;
}

// A wall along the second axis at 0, with a gap of `gap` wide about `middle`.
struct Wall {
  double middle, gap;

  [[nodiscard]] bool holds(const AxisVector& q) const { return connects(q, q, 0); }
  // The wall is 0.2 thick: what of the line lies within it must lie in the gap.
  [[nodiscard]] bool connects(const AxisVector& a, const AxisVector& b, double slack) const {
    double begin = 0, end = 1;
    for (const double side : {-1.0, 1.0}) {
      const double to_a = 0.1 - side * a[0], to_b = 0.1 - side * b[0];  // of the half plane that holds the wall
      if (to_a < 0 && to_b < 0) return true;
      if (to_a < 0) begin = std::max(begin, to_a / (to_a - to_b));
      if (to_b < 0) end = std::min(end, to_a / (to_a - to_b));
    }
    const auto passes = [&](double t) { return std::abs((a + t * (b - a))[1] - middle) <= gap / 2 + slack; };
    return begin > end || (passes(begin) && passes(end));
  }
  [[nodiscard]] FreeSpace space() const {
    return {[this](const AxisVector& q) { return holds(q); },
            [this](const AxisVector& a, const AxisVector& b) { return connects(a, b, 0); }};
  }
};

const AxisVector kLeft{{-1, 0}}, kRight{{1, 0}};

TEST(FindPath, TheStraightLineWhereItIsFree) {
  const Wall wall{.middle = 0, .gap = 0.5};
  const auto path = find_path(kLeft, kRight, square(2), wall.space(), {});
  ASSERT_TRUE(path) << path.error().line();
  EXPECT_EQ(path->iterations, 0);
  EXPECT_EQ(path->points, (std::vector{kLeft, kRight}));
}

TEST(FindPath, ThroughAGapAndHardlyLongerThanItMustBe) {
  const Wall wall{.middle = 1.5, .gap = 0.3};
  const double shortest = 2 * std::hypot(0.9, 1.35) + 0.2;
  double before = 0, after = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    const auto path = find_path(kLeft, kRight, square(2), wall.space(), {.seed = seed, .shortcuts = 200});
    ASSERT_TRUE(path) << path.error().line();
    EXPECT_GT(path->iterations, 0);
    EXPECT_EQ(path->points.front(), kLeft);
    EXPECT_EQ(path->points.back(), kRight);
    for (std::size_t i = 0; i + 1 < path->points.size(); ++i) {
      EXPECT_TRUE(wall.connects(path->points[i], path->points[i + 1], 1e-9)) << i;
    }
    EXPECT_GE(length_rad(path->points), shortest - 1e-9);
    EXPECT_LE(length_rad(path->points), path->found_rad + 1e-9);
    before += path->found_rad / shortest / 50;
    after += length_rad(path->points) / shortest / 50;
  }
  EXPECT_LT(after, 1.05);
  EXPECT_GT(before, 1.2) << "else there was nothing to shorten";
}

TEST(FindPath, OneSeedOnePath) {
  const Wall wall{.middle = -1.2, .gap = 0.4};
  const auto find = [&](std::uint64_t seed) {
    return find_path(kLeft, kRight, square(2), wall.space(), {.seed = seed});
  };
  const auto one = find(7), again = find(7), other = find(8);
  ASSERT_TRUE(one && again && other);
  EXPECT_EQ(one->points, again->points);
  EXPECT_NE(one->points, other->points);
}

TEST(FindPath, InSmallStepsItIsTheSamePath) {
  const Wall wall{.middle = 1.5, .gap = 0.3};
  const auto whole = find_path(kLeft, kRight, square(2), wall.space(), {.seed = 7});
  ASSERT_TRUE(whole);
  PathFinder finder(kLeft, kRight, square(2), {.seed = 7});
  int ticks = 1;
  auto ended = finder.advance(2, wall.space());
  for (; !ended; ++ticks) ended = finder.advance(2, wall.space());
  ASSERT_TRUE(*ended);
  EXPECT_EQ((*ended)->points, whole->points);
  EXPECT_EQ((*ended)->iterations, whole->iterations);
  EXPECT_GT(ticks, whole->iterations / 2);
}

TEST(FindPath, StaysWithinThePositionLimits) {
  const Wall wall{.middle = 1.9, .gap = 0.4};
  AxisLimits limits = square(2);
  const auto path = find_path(kLeft, kRight, limits, wall.space(), {});
  ASSERT_TRUE(path) << path.error().line();
  for (const AxisVector& point : path->points) EXPECT_LE(point.cwiseAbs().maxCoeff(), 2);
  limits.position_max[1] = 1.6;  // the gap is beyond it
  EXPECT_FALSE(find_path(kLeft, kRight, limits, wall.space(), {}));
}

TEST(FindPath, SaysWhyThereIsNone) {
  const auto error = [](const AxisVector& start, const AxisVector& goal, const Wall& wall) {
    const auto path = find_path(start, goal, square(2), wall.space(), {.iterations = 200});
    return path ? std::string("found") : path.error().line();
  };
  const Wall closed{.middle = 5, .gap = 0.1};
  EXPECT_THAT(error(kLeft, kRight, closed), HasSubstr("no path found with 200 samples"));
  EXPECT_THAT(error(AxisVector{{0, 0}}, kRight, closed), HasSubstr("start: something is in touch"));
  EXPECT_THAT(error(kLeft, AxisVector{{0.05, 0}}, closed), HasSubstr("goal: something is in touch"));
  EXPECT_THAT(error(kLeft, AxisVector{{3, 0}}, closed), HasSubstr("goal: is outside the position limits"));
  EXPECT_THAT(error(AxisVector{{0.5, std::nan("")}}, kRight, closed), HasSubstr("start: not one finite value"));
  EXPECT_THAT(error(AxisVector::Zero(3), kRight, closed), HasSubstr("start: not one finite value"));
}

}  // namespace
}  // namespace pons::motion
