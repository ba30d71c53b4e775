#include "pons/record/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace pons::record {
namespace {

TEST(Statistics, SpreadOfAFewValues) {
  const auto of = spread({4, 1, 3, 2, std::numeric_limits<double>::quiet_NaN()});
  ASSERT_TRUE(of);
  EXPECT_EQ(of->least, 1);
  EXPECT_EQ(of->lower_quartile, 1.75);
  EXPECT_EQ(of->median, 2.5);
  EXPECT_EQ(of->upper_quartile, 3.25);
  EXPECT_EQ(of->most, 4);
  EXPECT_EQ(spread({7})->upper_quartile, 7);
  EXPECT_FALSE(spread({}));
  EXPECT_FALSE(spread({std::numeric_limits<double>::infinity()}));
}

TEST(Statistics, NoEventStillHasABound) {
  for (const std::int64_t trials : {1, 20, 1000, 1'000'000}) {
    const double exact = 1 - std::pow(0.05, 1 / static_cast<double>(trials));
    EXPECT_NEAR(at_most(0, trials).value_or(0), exact, 1e-9 * exact + 1e-15) << trials;
  }
  EXPECT_NEAR(at_most(0, 4000).value_or(0), 3.0 / 4000, 0.01 * 3 / 4000) << "the rule of three";
}

// Published: Clopper-Pearson one-sided for 1 of 10 and 5 of 100 (NIST, qbeta(0.95, k + 1, n - k)).
TEST(Statistics, SomeEventsHaveTheirBound) {
  EXPECT_NEAR(at_most(1, 10).value_or(0), 0.39416, 1e-5);
  EXPECT_NEAR(at_most(5, 100).value_or(0), 0.10225, 1e-5);
  EXPECT_EQ(at_most(10, 10), 1.0);
  EXPECT_FALSE(at_most(0, 0));
  EXPECT_FALSE(at_most(2, 1));
  EXPECT_FALSE(at_most(-1, 1));
}

// What the bound promises: where the share is at the bound, as few events as were seen come once in twenty times.
TEST(Statistics, TheBoundIsMissedOnceInTwentyTimes) {
  const double share = at_most(3, 200).value_or(0);
  double few = 0, term = std::pow(1 - share, 200);
  for (int k = 0; k <= 3; ++k) {
    few += term;
    term *= share / (1 - share) * (200 - k) / (k + 1);
  }
  EXPECT_NEAR(few, 0.05, 1e-9);
}

}  // namespace
}  // namespace pons::record
