#include "pons/model/subproblems.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "pons/core/random.hpp"

namespace pons::model {
namespace {

Vector3 any_direction(Random& random) {
  return Vector3(random.normal(), random.normal(), random.normal()).normalized();
}

TEST(Subproblems, ATurnIsFoundAgain) {
  Random random(31);
  for (int i = 0; i < 10'000; ++i) {
    const Vector3 axis = any_direction(random), from = any_direction(random);
    const double rad = random.uniform(-3.1, 3.1);
    EXPECT_NEAR(solve_turn(axis, from, turned(axis, Angle::of(rad), from)).rad(), rad, 1e-9);
    EXPECT_TRUE(turned_back(axis, Angle::of(rad), turned(axis, Angle::of(rad), from)).isApprox(from, 1e-12));
  }
}

TEST(Subproblems, ASumHasTwoSolutionsOneOrNone) {
  Random random(32);
  for (int i = 0; i < 10'000; ++i) {
    const double x = random.normal(), y = random.normal(), q = random.uniform(-3.1, 3.1);
    const Angles found = solve_sum(x, y, x * std::cos(q) + y * std::sin(q), 1e-12);
    double nearest = INFINITY;
    for (const Angle& angle : found)
      nearest = std::min(nearest, std::abs(std::remainder(angle.rad() - q, 2 * std::numbers::pi)));
    EXPECT_LT(nearest, 1e-7);
    EXPECT_EQ(solve_sum(x, y, 1.001 * std::hypot(x, y), 1e-12).count, 0u);
  }
  EXPECT_EQ(solve_sum(0.6, 0.8, 1, 1e-12).count, 1u);
  EXPECT_NEAR(solve_sum(0.6, 0.8, -1, 1e-12).at[0].rad(), std::atan2(-0.8, -0.6), 1e-12);
  EXPECT_NEAR(solve_sum(0, 1, 1 + 1e-12, 1e-12).at[0].rad(), std::numbers::pi / 2, 1e-12);
  EXPECT_TRUE(solve_sum(0, 0, 0, 1e-12).any);
  EXPECT_FALSE(solve_sum(0, 0, 1, 1e-12).any);
}

// (x cos + y sin - z)(u cos + v sin - w) = 0 has the roots of both.
TEST(Subproblems, AQuarticHasTheRootsOfItsFactors) {
  Random random(33);
  for (int i = 0; i < 20'000; ++i) {
    const bool touching = i % 5 == 0;
    const double x = random.normal(), y = random.normal(), u = random.normal(), v = random.normal();
    const double z = random.uniform(-1.2, 1.2), w = touching ? std::hypot(u, v) : random.uniform(-1.2, 1.2);
    const Angles found = solve_quartic(x * u, x * v + y * u, y * v, -x * w - z * u, -y * w - z * v, z * w);
    std::size_t expected = 0;
    for (const Angles& part : {solve_sum(x, y, z, 1e-12), solve_sum(u, v, w, 1e-12)}) {
      for (const Angle& root : part) {
        double nearest = INFINITY;
        for (const Angle& angle : found)
          nearest = std::min(nearest, std::hypot(angle.cosine - root.cosine, angle.sine - root.sine));
        EXPECT_LT(nearest, touching ? 1e-3 : 1e-5) << i;  // a double root is the square root less exact, or worse
        ++expected;
      }
    }
    EXPECT_LE(found.count, expected) << i;
  }
  EXPECT_EQ(solve_quartic(0, 0, 0, 0, 0, 1).count, 0u);
  EXPECT_EQ(solve_quartic(0, 0, 0, 0, 0, 0).count, 0u);
}

}  // namespace
}  // namespace pons::model
