#include <gtest/gtest.h>

#include "pons/core/belief.hpp"
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

ObjectBelief box(std::uint32_t track, double x_m, double y_m, double z_m, double yaw_rad = 0) {
  ObjectBelief belief;
  belief.track = track;
  belief.world_from_top = pose_xyz_yaw(x_m, y_m, z_m, yaw_rad);
  belief.size_m = Vector3(0.3, 0.2, 0.1);
  belief.confidence = 0.97;
  belief.frames_seen = 3;
  return belief;
}

TEST(Belief, TheHigherOfTwoLiesOnTheOneThatIsPartlyHidden) {
  ObjectBelief lower = box(1, 0, 0, 0.1);
  const ObjectBelief upper = box(2, 0.1, 0.05, 0.2, 0.4);
  EXPECT_FALSE(lies_on(upper, lower)) << "seen whole";
  lower.confidence = 0.3;
  EXPECT_TRUE(lies_on(upper, lower));
  EXPECT_FALSE(lies_on(lower, upper));
  EXPECT_FALSE(lies_on(lower, lower));
}

TEST(Belief, NeighboursThatTouchDoNotLieOnEachOther) {
  ObjectBelief lower = box(1, 0, 0, 0.1);
  lower.confidence = 0.3;
  EXPECT_FALSE(lies_on(box(2, 0.295, 0, 0.2), lower));
  EXPECT_TRUE(lies_on(box(2, 0.285, 0, 0.2), lower));
  // Apart along a diagonal, though not along x or y.
  EXPECT_FALSE(lies_on(box(2, 0.25, 0.22, 0.2, 0.7), lower));
}

TEST(Belief, APartIsWithinAndAsHigh) {
  const ObjectBelief whole = box(1, 0, 0, 0.2, 0.7);
  EXPECT_TRUE(is_part(box(2, 0.08, 0.05, 0.21), whole));
  EXPECT_FALSE(is_part(box(2, 0.08, 0.05, 0.25), whole)) << "lies on it";
  EXPECT_FALSE(is_part(box(2, 0.2, 0.2, 0.2), whole)) << "touches it";
  EXPECT_FALSE(is_part(whole, whole));
  ObjectBelief larger = box(2, 0.08, 0.05, 0.21);
  larger.size_m.head<2>() *= 1.3;
  EXPECT_FALSE(is_part(larger, whole)) << "cut together with a neighbour";
}

TEST(Belief, OneWithTwoLabelsThatWasCutBetweenThemIsNotTwo) {
  ObjectBelief one = box(1, 0, 0, 0.2), other = box(2, 0, 0.16, 0.205);
  EXPECT_FALSE(is_part(one, other)) << "a neighbour, cut badly";
  one.code = "P1", other.code = "P2";
  EXPECT_TRUE(is_part(one, other) && is_part(other, one));
  other.world_from_top.translation().y() = 0.185;
  EXPECT_FALSE(is_part(one, other)) << "so far they may seem to overlap";
  other.world_from_top.translation() = Vector3(0, 0.16, 0.22);
  EXPECT_FALSE(is_part(one, other)) << "it may lie on it";
  other.world_from_top.translation().z() = 0.2;
  other.confidence = 0.3;
  EXPECT_FALSE(is_part(one, other)) << "partly hidden, it may end elsewhere";
  other.confidence = 0.97;
  other.size_m.x() = 0.19;
  EXPECT_FALSE(is_part(one, other)) << "much narrower, it is a neighbour, cut badly";
  other.size_m.x() = 0.25;
  EXPECT_TRUE(is_part(one, other));
  other.last_seen = one.last_seen + from_s(1);
  EXPECT_FALSE(is_part(one, other)) << "where the first was, it may have been pushed";
}

TEST(Belief, AGlimpseOfWhatNobodyHasReadIsNothing) {
  ObjectBelief lower = box(1, 0, 0, 0.1), upper = box(2, 0.1, 0.05, 0.2), part = box(3, 0.08, 0.05, 0.1);
  lower.confidence = 0.3;
  upper.frames_seen = part.frames_seen = 2;
  EXPECT_FALSE(lies_on(upper, lower));
  EXPECT_FALSE(is_part(part, lower));
  upper.code = part.code = "P1";
  EXPECT_TRUE(lies_on(upper, lower));
  EXPECT_TRUE(is_part(part, lower));
}

TEST(Belief, WhatLeansLiesOnWhatStandsHoweverHigh) {
  const ObjectBelief lower = box(1, 0, 0, 0.2);
  ObjectBelief upper = box(2, 0.2, 0, 0.1);
  upper.world_from_top.rotate(Eigen::AngleAxisd(-0.2, Vector3::UnitY()));
  EXPECT_TRUE(lies_on(upper, lower));
  EXPECT_FALSE(lies_on(lower, upper));
}

TEST(Belief, AHiddenOneMayGoOnUnderWhatLeansOnIt) {
  ObjectBelief lower = box(1, 0, 0, 0.2);
  ObjectBelief upper = box(2, 0.31, 0, 0.1);
  upper.world_from_top.rotate(Eigen::AngleAxisd(-0.2, Vector3::UnitY()));
  EXPECT_FALSE(lies_on(upper, lower));
  lower.confidence = 0.3;
  EXPECT_TRUE(lies_on(upper, lower));
}

}  // namespace
}  // namespace pons
