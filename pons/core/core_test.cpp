#include <gtest/gtest.h>

#include "pons/core/digest.hpp"
#include "pons/core/error.hpp"
#include "pons/core/random.hpp"
#include "pons/core/time.hpp"

namespace pons {
namespace {

TEST(Time, SecondsRoundToTheNearestNanosecond) {
  EXPECT_EQ(from_s(0.001).count(), 1'000'000);
  EXPECT_EQ(from_s(-0.001).count(), -1'000'000);
  EXPECT_EQ((Time(from_s(1.5)) - Time(from_s(0.25))).count(), 1'250'000'000);
}

TEST(Error, LineSaysWhereWhatAndHowToMend) {
  EXPECT_EQ((Error{"no arm", "cell.yaml:3", "name one"}.line()), "cell.yaml:3: no arm; name one");
  EXPECT_EQ((Error{"no arm", "", ""}.line()), "no arm");
}

TEST(Random, StreamsAreFixedForEver) {
  Random random(1);
  EXPECT_EQ(random.next(), 0x910a2dec89025cc1ULL);
  EXPECT_EQ(Random(1).fork(2).next(), Random(1).fork(2).next());
  EXPECT_NE(Random(1).fork(2).next(), Random(1).fork(3).next());
}

TEST(Random, NormalHasZeroMeanAndUnitVariance) {
  Random random(7);
  double sum = 0, squares = 0;
  constexpr int kCount = 100'000;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 0.02);
  EXPECT_NEAR(squares / kCount, 1.0, 0.02);
}

TEST(Digest, DependsOnEveryByteAndTheirOrder) {
  Digest a, b;
  a.add("ab");
  b.add("ba");
  EXPECT_NE(a.value(), b.value());
  EXPECT_EQ(Digest{}.value(), 0xcbf29ce484222325ULL);
}

}  // namespace
}  // namespace pons
