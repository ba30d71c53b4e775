#include "pons/cerebellum/motion_queue.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pons::cerebellum {
namespace {

constexpr auto kMs = std::chrono::milliseconds(1);

// Two axes, mirror images, at constant speed.
Segment straight(Time start, Duration duration, double from, double speed) {
  Segment segment;
  segment.start = start;
  segment.duration = duration;
  segment.coefficients[0] = {from, speed, 0, 0, 0, 0};
  segment.coefficients[1] = {-from, -speed, 0, 0, 0, 0};
  return segment;
}

Segment still(Time start, Duration duration, double at) { return straight(start, duration, at, 0); }

class MotionQueueTest : public testing::Test {
 protected:
  void SetUp() override { queue.rest(AxisVector::Zero(2), Time{}); }
  MotionQueue queue;
  AxisState state{AxisVector::Zero(2), AxisVector::Zero(2), AxisVector::Zero(2)};
};

TEST_F(MotionQueueTest, RestsUntilTheFirstSegmentBegins) {
  ASSERT_EQ(queue.append(still(Time(10 * kMs), 5 * kMs, 0), false, Time{}), Refusal::kNone);
  EXPECT_EQ(queue.sample(Time(9 * kMs), state), Phase::kResting);
  EXPECT_EQ(queue.sample(Time(10 * kMs), state), Phase::kFollowing);
  EXPECT_EQ(queue.sample(Time(15 * kMs), state), Phase::kFollowing);
  EXPECT_EQ(queue.sample(Time(16 * kMs), state), Phase::kResting);
  EXPECT_EQ(queue.end(), Time(15 * kMs));
}

TEST_F(MotionQueueTest, RefusesJumpsOfPositionSpeedAndAcceleration) {
  EXPECT_EQ(queue.append(still(Time(kMs), kMs, 2e-6), false, Time{}), Refusal::kDiscontinuous);
  EXPECT_EQ(queue.append(straight(Time(kMs), kMs, 0, 2e-5), false, Time{}), Refusal::kDiscontinuous);
  Segment push = still(Time(kMs), kMs, 0);
  push.coefficients[1][2] = 1e-3;  // half of 2e-3 rad/s²
  EXPECT_EQ(queue.append(push, false, Time{}), Refusal::kDiscontinuous);
  EXPECT_EQ(queue.append(still(Time(kMs), kMs, 0.5e-6), false, Time{}), Refusal::kNone);
}

TEST_F(MotionQueueTest, RefusesThePastTheInfiniteAndTheEmpty) {
  EXPECT_EQ(queue.append(still(Time(4 * kMs), kMs, 0), false, Time(5 * kMs)), Refusal::kFromThePast);
  EXPECT_EQ(queue.append(still(Time(6 * kMs), Duration{0}, 0), false, Time(5 * kMs)), Refusal::kNotFinite);
  Segment bad = still(Time(6 * kMs), kMs, 0);
  bad.coefficients[7][5] = NAN;
  EXPECT_EQ(queue.append(bad, false, Time(5 * kMs)), Refusal::kNotFinite);
  EXPECT_EQ(queue.append(still(Time(Duration::max()), kMs, 0), false, Time(5 * kMs)), Refusal::kNotFinite);
}

TEST_F(MotionQueueTest, RefusesAGapWhileMovingAndAllowsItAtRest) {
  ASSERT_EQ(queue.append(still(Time(kMs), kMs, 0), false, Time{}), Refusal::kNone);
  ASSERT_EQ(queue.append(still(Time(20 * kMs), kMs, 0), false, Time{}), Refusal::kNone);
  EXPECT_EQ(queue.sample(Time(10 * kMs), state), Phase::kResting);
  // The speed of the last piece is above the tolerance of rest, its jump is not: it may follow, but nothing may leave a
  // gap.
  ASSERT_EQ(queue.append(straight(Time(21 * kMs), kMs, 0, 1e-5), false, Time{}), Refusal::kNone);
  ASSERT_EQ(queue.append(straight(Time(22 * kMs), kMs, 1e-8, 2e-5), false, Time{}), Refusal::kNone);
  EXPECT_EQ(queue.append(straight(Time(24 * kMs), kMs, 3e-8, 2e-5), false, Time{}), Refusal::kGap);
  EXPECT_EQ(queue.append(straight(Time(22 * kMs), kMs, 3e-8, 2e-5), false, Time{}), Refusal::kGap);
}

TEST_F(MotionQueueTest, SplicingReplacesWhatComesLaterAndMustFit) {
  // A slow ramp up from rest, so that there is motion to splice into.
  Segment ramp = still(Time(kMs), 100 * kMs, 0);
  ramp.coefficients[0][3] = 10;  // jerk of 60 rad/s³
  ASSERT_EQ(queue.append(ramp, false, Time{}), Refusal::kNone);
  ASSERT_EQ(queue.sample(Time(50 * kMs), state), Phase::kFollowing);
  const double t = 0.049;
  EXPECT_NEAR(state.position[0], 10 * t * t * t, 1e-12);

  Segment branch = still(Time(81 * kMs), 20 * kMs, 0);
  const double u = 0.080;
  branch.coefficients[0] = {10 * u * u * u, 30 * u * u, 30 * u, -10, 0, 0};
  ASSERT_EQ(queue.append(branch, true, Time(50 * kMs)), Refusal::kNone);
  EXPECT_EQ(queue.end(), Time(101 * kMs));
  ASSERT_EQ(queue.sample(Time(81 * kMs), state), Phase::kFollowing);
  EXPECT_NEAR(state.acceleration[0], 60 * u, 1e-9);
  ASSERT_EQ(queue.sample(Time(91 * kMs), state), Phase::kFollowing);
  EXPECT_NEAR(state.acceleration[0], 60 * u - 60 * 0.01, 1e-9);

  branch.start = Time(95 * kMs);
  EXPECT_EQ(queue.append(branch, true, Time(91 * kMs)), Refusal::kDiscontinuous);
}

TEST_F(MotionQueueTest, SaysWhenMotionEndsMoving) {
  Segment ramp = still(Time(kMs), 10 * kMs, 0);
  ramp.coefficients[0][3] = 10;
  ASSERT_EQ(queue.append(ramp, false, Time{}), Refusal::kNone);
  EXPECT_EQ(queue.sample(Time(11 * kMs), state), Phase::kFollowing);
  EXPECT_EQ(queue.sample(Time(12 * kMs), state), Phase::kEndedMoving);
}

TEST_F(MotionQueueTest, HoldsItsCapacity) {
  Time start(kMs);
  for (std::size_t i = 0; i < MotionQueue::kCapacity; ++i, start += kMs) {
    ASSERT_EQ(queue.append(still(start, kMs, 0), false, Time{}), Refusal::kNone);
  }
  EXPECT_EQ(queue.append(still(start, kMs, 0), false, Time{}), Refusal::kFull);
  EXPECT_EQ(queue.sample(Time(200 * kMs), state), Phase::kFollowing);
  EXPECT_EQ(queue.append(still(start, kMs, 0), false, Time(200 * kMs)), Refusal::kNone);
}

}  // namespace
}  // namespace pons::cerebellum
