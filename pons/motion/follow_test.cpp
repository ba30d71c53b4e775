#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pons/motion/motion.hpp"

namespace pons::motion {
namespace {

constexpr Time kAt{std::chrono::milliseconds(250)};

AxisLimits limits() {
  return {AxisVector::Constant(2, -3), AxisVector::Constant(2, 3),   AxisVector::Constant(2, 3.14),
          AxisVector::Constant(2, 20), AxisVector::Constant(2, 400), AxisVector::Constant(2, 100)};
}

Expected<AxisVector> circle(double t) { return AxisVector{{std::cos(2 * t), std::sin(2 * t)}}; }
AxisState on_circle(double t) {
  return {AxisVector{{std::cos(2 * t), std::sin(2 * t)}}, AxisVector{{-2 * std::sin(2 * t), 2 * std::cos(2 * t)}},
          AxisVector{{-4 * std::cos(2 * t), -4 * std::sin(2 * t)}}};
}

TEST(Follow, KeepsToAStraightLine) {
  const auto line = [](double t) -> Expected<AxisVector> { return AxisVector{{0.5 * t, 1 - t}}; };
  const AxisState start{AxisVector{{0, 1}}, AxisVector{{0.5, -1}}, AxisVector::Zero(2)};
  const auto trajectory = follow(start, kAt, line, 1.3, 0.02, limits());
  ASSERT_TRUE(trajectory) << trajectory.error().line();
  EXPECT_EQ(trajectory->front().start, kAt);
  EXPECT_EQ(trajectory->back().end(), kAt + from_s(1.3));
  for (double t = 0; t <= 1.3; t += 0.001) {
    const AxisState state = sample(*trajectory, kAt + from_s(t), 2);
    EXPECT_NEAR(state.position[0], 0.5 * t, 1e-9);
    EXPECT_NEAR(state.position[1], 1 - t, 1e-9);
    EXPECT_NEAR(state.acceleration[0], 0, 1e-6);
  }
}

TEST(Follow, KeepsToACurveWithContinuousAcceleration) {
  const auto trajectory = follow(on_circle(0), kAt, circle, std::numbers::pi, 0.02, limits());
  ASSERT_TRUE(trajectory) << trajectory.error().line();
  for (double t = 0; t <= std::numbers::pi; t += 0.001) {
    const AxisState state = sample(*trajectory, kAt + from_s(t), 2), truth = on_circle(t);
    EXPECT_LT((state.position - truth.position).norm(), 1e-7);
    EXPECT_LT((state.speed - truth.speed).norm(), 1e-5);
    EXPECT_LT((state.acceleration - truth.acceleration).norm(), 5e-3);
  }
  for (std::size_t k = 1; k < trajectory->size(); ++k) {
    AxisState before = on_circle(0), after = before;
    sample((*trajectory)[k - 1], (*trajectory)[k].start, before);
    sample((*trajectory)[k], (*trajectory)[k].start, after);
    EXPECT_LT((before.position - after.position).norm(), 1e-9);
    EXPECT_LT((before.speed - after.speed).norm(), 1e-9);
    EXPECT_LT((before.acceleration - after.acceleration).norm(), 1e-7);
  }
}

TEST(Follow, NamesTheAxisAndTheExcess) {
  AxisLimits slow = limits();
  slow.speed_rad_s[1] = 1.6;
  const auto trajectory = follow(on_circle(0.5), kAt, [](double t) { return circle(t + 0.5); }, 1.5, 0.02, slow);
  ASSERT_FALSE(trajectory);
  EXPECT_NE(trajectory.error().what.find("axis 2 needs 1."), std::string::npos) << trajectory.error().line();
  EXPECT_NE(trajectory.error().what.find("speed limit"), std::string::npos) << trajectory.error().line();
}

TEST(Follow, RefusesAPathThatBeginsElsewhere) {
  AxisState away = on_circle(0);
  away.position[0] += 0.01;
  const auto trajectory = follow(away, kAt, circle, 1, 0.02, limits());
  ASSERT_FALSE(trajectory);
  EXPECT_NE(trajectory.error().what.find("position 1 of axis 1"), std::string::npos) << trajectory.error().line();
}

TEST(Follow, PassesThePathsOwnErrorOn) {
  const auto broken = [](double t) -> Expected<AxisVector> {
    if (t > 0.5) return fail("out of reach", "path");
    return circle(t);
  };
  const auto trajectory = follow(on_circle(0), kAt, broken, 1, 0.02, limits());
  ASSERT_FALSE(trajectory);
  EXPECT_EQ(trajectory.error().what, "out of reach");
  EXPECT_FALSE(follow(on_circle(0), kAt, circle, 0, 0.02, limits()));
  EXPECT_FALSE(follow(on_circle(0), kAt, circle, 1, 0, limits()));
}

}  // namespace
}  // namespace pons::motion
