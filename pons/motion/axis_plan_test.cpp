#include "pons/motion/axis_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/motion/stop.hpp"

namespace pons::motion {
namespace {

constexpr double kTight = 1e-9;

// Any start from which the speed limit can still be kept, any end inside the limits, over decades of sizes.
AxisTask draw(Random& random) {
  const auto decade = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
  AxisTask c{{}, 0, 0, AxisBounds::symmetric(decade(0.3, 4), decade(1, 30), decade(10, 1000))};
  c.start.position = random.uniform(-3, 3);
  c.start.acceleration = random.below(4) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.acceleration_max;
  do {
    c.start.speed = random.below(4) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.speed_max;
    if (std::abs(coasting_speed(c.start, c.bounds.jerk)) <= c.bounds.speed_max) break;
    c.start.acceleration /= 2;
  } while (true);
  c.end_position = c.start.position + (random.below(8) == 0 ? 0 : (random.below(2) != 0 ? 1 : -1) * decade(1e-7, 6));
  c.end_speed = random.below(3) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.speed_max;
  return c;
}

void expect_limits(const AxisProfile& profile, const AxisBounds& bounds) {
  const AxisProfile::Extent extent = profile.extent();
  EXPECT_LE(extent.speed_max, bounds.speed_max * (1 + kTight));
  EXPECT_LE(extent.acceleration_max, bounds.acceleration_max * (1 + kTight));
  EXPECT_LE(extent.jerk_max, bounds.jerk * (1 + kTight));
}

void expect_end(const AxisProfile& profile, double position, double speed) {
  EXPECT_NEAR(profile.end().position, position, kTight);
  EXPECT_NEAR(profile.end().speed, speed, kTight);
  EXPECT_NEAR(profile.end().acceleration, 0, 1e-7);
}

TEST(AxisPlan, ArrivesWithinLimitsFromAnyStart) {
  Random random(1);
  for (int i = 0; i < 100'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisTask c = draw(random);
    const PositionPlan plan(c);
    AxisProfile profile;
    plan.fastest(profile);
    expect_end(profile, c.end_position, c.end_speed);
    expect_limits(profile, c.bounds);
    EXPECT_NEAR(profile.duration_s(), plan.duration_s(), kTight);
  }
}

TEST(AxisPlan, ArrivesInAnyPossibleTime) {
  Random random(2);
  for (int i = 0; i < 100'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisTask c = draw(random);
    const PositionPlan plan(c);
    const double fastest = plan.duration_s();
    const double wish = fastest * (random.below(4) == 0 ? 1 : random.uniform(1, 3));
    const double duration = plan.possible_s(wish);
    EXPECT_GE(duration, wish);
    if (c.end_speed == 0) {
      EXPECT_EQ(duration, wish);
    }
    AxisProfile profile;
    plan.in_time(duration, profile);
    EXPECT_NEAR(profile.duration_s(), duration, kTight);
    EXPECT_NEAR(profile.at(duration).position, c.end_position, kTight);
    EXPECT_NEAR(profile.at(duration).speed, c.end_speed, kTight);
    expect_limits(profile, c.bounds);
  }
}

// A motion within the limits that nobody planned well: some pushes, then to the end speed.
bool stumble(const AxisTask& c, Random& random, AxisProfile& profile) {
  profile = AxisProfile(c.start);
  const double scale = c.bounds.acceleration_max / c.bounds.jerk + c.bounds.speed_max / c.bounds.acceleration_max;
  const double share = std::exp(random.uniform(std::log(1e-3), 0));
  for (std::uint64_t pushes = random.below(5); pushes > 0; --pushes) {
    const double jerk = c.bounds.jerk * (random.below(4) == 0 ? 0 : (random.below(2) != 0 ? 1 : -1));
    profile.add(share * scale * random.uniform(), jerk);
  }
  AxisProfile last;
  SpeedPlan(profile.end(), c.end_speed, c.bounds).fastest(last);
  for (std::size_t i = 0; i < last.phases(); ++i) profile.add(last.begin_s(i + 1) - last.begin_s(i), last.jerk(i));
  const AxisProfile::Extent extent = profile.extent();
  return extent.speed_max <= c.bounds.speed_max && extent.acceleration_max <= c.bounds.acceleration_max;
}

TEST(AxisPlan, NothingWithinTheLimitsIsFaster) {
  Random random(3);
  int compared = 0;
  while (compared < 300'000 && !testing::Test::HasFailure()) {
    const AxisTask c = draw(random);
    AxisProfile other;
    if (!stumble(c, random, other)) continue;
    ++compared;
    SCOPED_TRACE(compared);
    const PositionPlan plan({c.start, other.end().position, c.end_speed, c.bounds});
    EXPECT_LE(plan.duration_s(), other.duration_s() + 1e-7);
    EXPECT_NEAR(plan.possible_s(other.duration_s()), other.duration_s(), 1e-6);
  }
}

TEST(AxisPlan, RestToRestTakesTheClosedFormTime) {
  // Biagiotti and Melchiorri 2008, section 3.4: the double-S trajectory.
  const AxisBounds bounds = AxisBounds::symmetric(3.14, 20, 400);
  for (double distance = 1e-6; distance < 10; distance *= 1.3) {
    const double v = bounds.speed_max, a = bounds.acceleration_max, j = bounds.jerk;
    double expected = 4 * std::cbrt(distance / (2 * j));
    if (distance > 2 * a * a * a / (j * j)) expected = a / j + std::sqrt(a * a / (j * j) + 4 * distance / a);
    if (distance > v * (v / a + a / j)) expected = distance / v + v / a + a / j;
    EXPECT_NEAR(PositionPlan({{}, distance, 0, bounds}).duration_s(), expected, kTight) << distance;
    EXPECT_NEAR(PositionPlan({{}, -distance, 0, bounds}).duration_s(), expected, kTight) << distance;
  }
}

TEST(AxisPlan, KeepsAConstantSpeedThatFits) {
  AxisProfile profile;
  PositionPlan({{1, 0.5, 0}, 2, 0.5, AxisBounds::symmetric(3, 20, 400)}).in_time(2, profile);
  EXPECT_NEAR(profile.extent().acceleration_max, 0, 1e-6);
  EXPECT_NEAR(profile.at(1).position, 1.5, kTight);
}

TEST(AxisPlan, ReachesASpeedFromBeyondTheLimits) {
  Random random(4);
  const AxisBounds bounds = AxisBounds::symmetric(2, 10, 200);
  for (int i = 0; i < 20'000 && !testing::Test::HasFailure(); ++i) {
    const AxisPoint start{0, random.uniform(-4, 4), random.uniform(-30, 30)};
    const double end_speed = random.uniform(-2, 2);
    AxisProfile profile;
    SpeedPlan(start, end_speed, bounds).fastest(profile);
    const AxisProfile::Extent extent = profile.extent();
    EXPECT_NEAR(profile.end().speed, end_speed, kTight);
    EXPECT_NEAR(profile.end().acceleration, 0, 1e-7);
    EXPECT_LE(extent.jerk_max, bounds.jerk);
    EXPECT_LE(extent.acceleration_max, std::max(std::abs(start.acceleration), bounds.acceleration_max * (1 + kTight)));
    const double coasting = std::abs(coasting_speed(start, bounds.jerk));
    EXPECT_LE(extent.speed_max, std::max({coasting, std::abs(start.speed), std::abs(end_speed)}) + kTight);
  }
}

TEST(AxisPlan, StopsAllAxesTogetherAlongTheWay) {
  AxisLimits limits;
  limits.position_min = AxisVector::Constant(3, -10);
  limits.position_max = AxisVector::Constant(3, 10);
  limits.speed_rad_s = AxisVector::Constant(3, 3);
  limits.acceleration_rad_s2 = AxisVector::Constant(3, 20);
  limits.jerk_rad_s3 = AxisVector::Constant(3, 400);
  AxisState start{AxisVector::Zero(3), AxisVector::Zero(3), AxisVector::Zero(3)};
  start.speed << 2, -1, 0.2;
  const AxisBounds bounds = AxisBounds::symmetric(3, 20, 400);
  std::array<AxisProfile, 3> profiles;
  plan_stop(start, limits, profiles);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    expect_limits(profiles[axis], bounds);
    EXPECT_NEAR(profiles[axis].duration_s(), SpeedPlan({0, 2, 0}, 0, bounds).duration_s(), kTight);
    EXPECT_NEAR(profiles[axis].end().position / start.speed[static_cast<Eigen::Index>(axis)],
                profiles[0].end().position / 2, kTight);
  }
  // Too near to its limit to keep company: as fast as it can.
  limits.position_min[1] = SpeedPlan({0, -1, 0}, 0, bounds).end_position() - 1e-6;
  plan_stop(start, limits, profiles);
  EXPECT_GE(profiles[1].extent().position_min, limits.position_min[1]);
}

}  // namespace
}  // namespace pons::motion
