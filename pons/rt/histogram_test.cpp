#include "pons/rt/histogram.hpp"

#include <gtest/gtest.h>

namespace pons::rt {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Histogram, EmptyIsZero) {
  const Histogram histogram;
  EXPECT_EQ(histogram.percentile(99).count(), 0);
  EXPECT_EQ(histogram.min().count(), 0);
  EXPECT_EQ(histogram.max().count(), 0);
  EXPECT_EQ(histogram.mean().count(), 0);
}

TEST(Histogram, PercentilesAreWithinTwoPercentAndEndsExact) {
  Histogram histogram;
  for (int us = 1; us <= 100'000; ++us) histogram.record(microseconds(us));
  EXPECT_EQ(histogram.count(), 100'000u);
  EXPECT_EQ(histogram.min(), microseconds(1));
  EXPECT_EQ(histogram.max(), milliseconds(100));
  for (const double percent : {1.0, 50.0, 90.0, 99.0, 99.9}) {
    EXPECT_NEAR(static_cast<double>(histogram.percentile(percent).count()), percent * 1e6, percent * 1e6 * 0.02);
  }
  EXPECT_EQ(histogram.percentile(100), milliseconds(100));
  EXPECT_NEAR(static_cast<double>(histogram.mean().count()), 50e6, 1e5);
}

TEST(Histogram, CountsWhatIsAbove) {
  Histogram histogram;
  for (int us = 1; us <= 1000; ++us) histogram.record(microseconds(us));
  EXPECT_NEAR(static_cast<double>(histogram.count_above(microseconds(100))), 900, 2);
  EXPECT_EQ(histogram.count_above(microseconds(1000)), 0U);
  EXPECT_EQ(histogram.count_above(Duration(-1)), 1000U);
}

TEST(Histogram, TakesWhatIsOutOfRange) {
  Histogram histogram;
  histogram.record(Duration(-5));
  histogram.record(seconds(1000));
  EXPECT_EQ(histogram.min().count(), 0);
  EXPECT_EQ(histogram.percentile(50).count(), 0);
  EXPECT_GE(histogram.max(), seconds(68));
}

TEST(Histogram, AddsUp) {
  Histogram a, b;
  a.record(microseconds(10));
  b.record(milliseconds(40));
  a.add(b);
  EXPECT_EQ(a.count(), 2u);
  EXPECT_EQ(a.min(), microseconds(10));
  EXPECT_EQ(a.max(), milliseconds(40));
  EXPECT_NEAR(static_cast<double>(a.percentile(50).count()), 10e3, 200);
}

}  // namespace
}  // namespace pons::rt
