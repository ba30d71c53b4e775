#include "pons/motion/axis_profile.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "pons/core/random.hpp"

namespace pons::motion {
namespace {

constexpr double kTight = 1e-9;

struct Case {
  AxisPoint start;
  double end_position, end_speed;
  AxisBounds bounds;
};

// Any start from which the speed limit can still be kept, any end inside the limits, over decades of sizes.
Case draw(Random& random) {
  const auto decade = [&](double low, double high) { return std::exp(random.uniform(std::log(low), std::log(high))); };
  Case c{{}, 0, 0, {decade(0.3, 4), decade(1, 30), decade(10, 1000)}};
  c.start.position = random.uniform(-3, 3);
  c.start.acceleration = random.below(4) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.acceleration;
  do {
    c.start.speed = random.below(4) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.speed;
    if (std::abs(coasting_speed(c.start, c.bounds.jerk)) <= c.bounds.speed) break;
    c.start.acceleration /= 2;
  } while (true);
  c.end_position = c.start.position + (random.below(8) == 0 ? 0 : (random.below(2) != 0 ? 1 : -1) * decade(1e-7, 6));
  c.end_speed = random.below(3) == 0 ? 0 : random.uniform(-1, 1) * c.bounds.speed;
  return c;
}

void expect_limits(const AxisProfile& profile, const AxisBounds& bounds) {
  const AxisProfile::Extent extent = profile.extent();
  EXPECT_LE(extent.speed_max, bounds.speed * (1 + kTight));
  EXPECT_LE(extent.acceleration_max, bounds.acceleration * (1 + kTight));
  EXPECT_LE(extent.jerk_max, bounds.jerk * (1 + kTight));
}

void expect_end(const AxisProfile& profile, double position, double speed) {
  EXPECT_NEAR(profile.end().position, position, kTight);
  EXPECT_NEAR(profile.end().speed, speed, kTight);
  EXPECT_NEAR(profile.end().acceleration, 0, 1e-7);
}

TEST(AxisProfile, ArrivesWithinLimitsFromAnyStart) {
  Random random(1);
  for (int i = 0; i < 100'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Case c = draw(random);
    const AxisProfile profile = plan_to_position(c.start, c.end_position, c.end_speed, c.bounds);
    expect_end(profile, c.end_position, c.end_speed);
    expect_limits(profile, c.bounds);
    EXPECT_NEAR(profile.duration_s(), fastest_duration_s(c.start, c.end_position, c.end_speed, c.bounds), kTight);
  }
}

TEST(AxisProfile, ArrivesInAnyPossibleTime) {
  Random random(2);
  for (int i = 0; i < 100'000 && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const Case c = draw(random);
    const double fastest = fastest_duration_s(c.start, c.end_position, c.end_speed, c.bounds);
    const double wish = fastest * (random.below(4) == 0 ? 1 : random.uniform(1, 3));
    const double duration = possible_duration_s(c.start, c.end_position, c.end_speed, wish, c.bounds);
    EXPECT_GE(duration, wish);
    if (c.end_speed == 0) {
      EXPECT_EQ(duration, wish);
    }
    const AxisProfile profile = plan_in_time(c.start, c.end_position, c.end_speed, duration, c.bounds);
    EXPECT_NEAR(profile.duration_s(), duration, kTight);
    EXPECT_NEAR(profile.at(duration).position, c.end_position, kTight);
    EXPECT_NEAR(profile.at(duration).speed, c.end_speed, kTight);
    expect_limits(profile, c.bounds);
  }
}

// A motion within the limits that nobody planned well: some pushes, then to the end speed.
bool stumble(const Case& c, Random& random, AxisProfile& profile) {
  profile = AxisProfile(c.start);
  const double scale = c.bounds.acceleration / c.bounds.jerk + c.bounds.speed / c.bounds.acceleration;
  const double share = std::exp(random.uniform(std::log(1e-3), 0));
  for (std::uint64_t pushes = random.below(5); pushes > 0; --pushes) {
    const double jerk = c.bounds.jerk * (random.below(4) == 0 ? 0 : (random.below(2) != 0 ? 1 : -1));
    profile.add(share * scale * random.uniform(), jerk);
  }
  const AxisProfile last = plan_to_speed(profile.end(), c.end_speed, c.bounds);
  for (std::size_t i = 0; i < last.phases(); ++i) profile.add(last.begin_s(i + 1) - last.begin_s(i), last.jerk(i));
  const AxisProfile::Extent extent = profile.extent();
  return extent.speed_max <= c.bounds.speed && extent.acceleration_max <= c.bounds.acceleration;
}

TEST(AxisProfile, NothingWithinTheLimitsIsFaster) {
  Random random(3);
  int compared = 0;
  while (compared < 300'000 && !testing::Test::HasFailure()) {
    const Case c = draw(random);
    AxisProfile other;
    if (!stumble(c, random, other)) continue;
    ++compared;
    SCOPED_TRACE(compared);
    const double end_position = other.end().position;
    EXPECT_LE(fastest_duration_s(c.start, end_position, c.end_speed, c.bounds), other.duration_s() + 1e-7);
    EXPECT_NEAR(possible_duration_s(c.start, end_position, c.end_speed, other.duration_s(), c.bounds),
                other.duration_s(), 1e-6);
  }
}

TEST(AxisProfile, RestToRestTakesTheClosedFormTime) {
  // Biagiotti and Melchiorri 2008, section 3.4: the double-S trajectory.
  const AxisBounds bounds{3.14, 20, 400};
  for (double distance = 1e-6; distance < 10; distance *= 1.3) {
    const double v = bounds.speed, a = bounds.acceleration, j = bounds.jerk;
    double expected = 4 * std::cbrt(distance / (2 * j));
    if (distance > 2 * a * a * a / (j * j)) expected = a / j + std::sqrt(a * a / (j * j) + 4 * distance / a);
    if (distance > v * (v / a + a / j)) expected = distance / v + v / a + a / j;
    EXPECT_NEAR(fastest_duration_s({}, distance, 0, bounds), expected, kTight) << distance;
    EXPECT_NEAR(fastest_duration_s({}, -distance, 0, bounds), expected, kTight) << distance;
  }
}

TEST(AxisProfile, KeepsAConstantSpeedThatFits) {
  const AxisProfile profile = plan_in_time({1, 0.5, 0}, 2, 0.5, 2, {3, 20, 400});
  EXPECT_NEAR(profile.extent().acceleration_max, 0, 1e-6);
  EXPECT_NEAR(profile.at(1).position, 1.5, kTight);
}

TEST(AxisProfile, ReachesASpeedFromBeyondTheLimits) {
  Random random(4);
  const AxisBounds bounds{2, 10, 200};
  for (int i = 0; i < 20'000 && !testing::Test::HasFailure(); ++i) {
    const AxisPoint start{0, random.uniform(-4, 4), random.uniform(-30, 30)};
    const double end_speed = random.uniform(-2, 2);
    const AxisProfile profile = plan_to_speed(start, end_speed, bounds);
    const AxisProfile::Extent extent = profile.extent();
    EXPECT_NEAR(profile.end().speed, end_speed, kTight);
    EXPECT_NEAR(profile.end().acceleration, 0, 1e-7);
    EXPECT_LE(extent.jerk_max, bounds.jerk);
    EXPECT_LE(extent.acceleration_max, std::max(std::abs(start.acceleration), bounds.acceleration * (1 + kTight)));
    const double coasting = std::abs(coasting_speed(start, bounds.jerk));
    EXPECT_LE(extent.speed_max, std::max({coasting, std::abs(start.speed), std::abs(end_speed)}) + kTight);
  }
}

TEST(AxisProfile, StopsAllAxesTogetherAlongTheWay) {
  AxisLimits limits;
  limits.position_min = AxisVector::Constant(3, -10);
  limits.position_max = AxisVector::Constant(3, 10);
  limits.speed_rad_s = AxisVector::Constant(3, 3);
  limits.acceleration_rad_s2 = AxisVector::Constant(3, 20);
  limits.jerk_rad_s3 = AxisVector::Constant(3, 400);
  AxisState start{AxisVector::Zero(3), AxisVector::Zero(3), AxisVector::Zero(3)};
  start.speed << 2, -1, 0.2;
  std::array<AxisProfile, 3> profiles;
  plan_stop(start, limits, profiles);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    expect_limits(profiles[axis], {3, 20, 400});
    EXPECT_NEAR(profiles[axis].duration_s(), plan_to_speed({0, 2, 0}, 0, {3, 20, 400}).duration_s(), kTight);
    EXPECT_NEAR(profiles[axis].end().position / start.speed[static_cast<Eigen::Index>(axis)],
                profiles[0].end().position / 2, kTight);
  }
  // Too near to its limit to keep company: as fast as it can.
  limits.position_min[1] = plan_to_speed({0, -1, 0}, 0, {3, 20, 400}).end().position - 1e-6;
  plan_stop(start, limits, profiles);
  EXPECT_GE(profiles[1].extent().position_min, limits.position_min[1]);
}

}  // namespace
}  // namespace pons::motion
