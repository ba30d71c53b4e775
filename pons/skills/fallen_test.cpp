#include "pons/skills/fallen.hpp"

#include <gtest/gtest.h>

namespace pons::skills {
namespace {

Time at(double s) { return Time(from_s(s)); }

class FallenTest : public testing::Test {
 protected:
  static ObjectBelief box(std::uint32_t track, const Vector3& size_m, double x_m) {
    ObjectBelief object;
    object.track = track;
    object.size_m = size_m;
    object.world_from_top.translation() = Vector3(x_m, 0, 1.0);
    object.frames_seen = 3;
    return object;
  }
  // One of that size about there.
  static ObjectBelief like_it(std::uint32_t track = 7) { return box(track, {0.302, 0.196, 0.105}, 0.2); }
  void falls(const std::vector<ObjectBelief>& believed = {}) {
    fallen_.fell("A", {0.3, 0.2, 0.1}, {0.1, 0.1, 0.9}, 1.2, believed, at(10));
  }
  // As which track it is recognised; 0: none.
  std::uint32_t seen(const std::vector<ObjectBelief>& objects, double after_s = 1) {
    const auto recognised = fallen_.recognise(objects, 0, at(10 + after_s));
    if (recognised.empty()) return 0;
    EXPECT_EQ(recognised.size(), 1);
    EXPECT_EQ(recognised[0].second, "A");
    return recognised[0].first;
  }
  [[nodiscard]] std::vector<ObjectBelief> rooms() const {
    std::vector<ObjectBelief> objects;
    fallen_.add_unseen(objects, 0.2, at(10));
    return objects;
  }
  Fallen fallen_{0.9, 1.2};
};

TEST_F(FallenTest, WhatIsSeenFirstAboutThereAndIsAsLargeIsIt) {
  falls({box(1, {0.2, 0.1, 0.1}, 0)});
  EXPECT_TRUE(fallen_.awaits("A"));
  EXPECT_EQ(seen({box(1, {0.2, 0.1, 0.1}, 0)}), 0);
  EXPECT_EQ(seen({box(1, {0.2, 0.1, 0.1}, 0), like_it()}), 7);
  EXPECT_FALSE(fallen_.awaits("A"));
  EXPECT_EQ(seen({like_it()}), 0) << "once";
}

TEST_F(FallenTest, ItMayLieOnAnotherSide) {
  falls();
  EXPECT_EQ(seen({box(7, {0.2, 0.1, 0.3}, 0)}), 7);
}

TEST_F(FallenTest, NothingElseIsTakenForIt) {
  ObjectBelief read = like_it(), two_codes = like_it(), glimpsed = like_it();
  read.code = "B";
  two_codes.disputed = {"B", "C"};
  glimpsed.frames_seen = 1;
  falls();
  EXPECT_EQ(seen({box(7, {0.3, 0.2, 0.15}, 0.2)}), 0) << "of another size";
  EXPECT_EQ(seen({box(7, {0.3, 0.2, 0.1}, 0.6)}), 0) << "too far away";
  EXPECT_EQ(seen({read}), 0);
  EXPECT_EQ(seen({two_codes}), 0);
  EXPECT_EQ(seen({glimpsed}), 0);
  EXPECT_EQ(seen({like_it(7), like_it(8)}), 0) << "either may be it";
  EXPECT_EQ(seen({like_it(0)}), 0) << "only an obstacle";
  EXPECT_EQ(seen({like_it()}), 7);
}

TEST_F(FallenTest, WhatWasThereBeforeIsNotIt) {
  falls({like_it()});
  EXPECT_EQ(seen({like_it()}), 0);
}

// One as large whose track was lost meanwhile comes back under another number.
TEST_F(FallenTest, NothingIsItWhileAnotherMayHaveBeenFoundAgain) {
  falls({like_it(3)});
  EXPECT_EQ(seen({like_it(7)}), 0);
  EXPECT_EQ(seen({like_it(3), like_it(7)}), 7);
}

TEST_F(FallenTest, ItRidesWithTheBelt) {
  falls();
  EXPECT_EQ(fallen_.recognise({box(7, {0.3, 0.2, 0.1}, 0.8)}, 0.5, at(11)).size(), 1);
}

TEST_F(FallenTest, AfterAWhileOrOnceItsCodeIsReadNothingIsAwaited) {
  falls();
  EXPECT_EQ(seen({like_it()}, 4), 0);
  EXPECT_FALSE(fallen_.awaits("A"));
  falls();
  ObjectBelief read = like_it();
  read.code = "A";
  EXPECT_EQ(seen({read}), 0);
  EXPECT_FALSE(fallen_.awaits("A"));
}

TEST_F(FallenTest, BeyondTheViewItIsInTheWayUntilItHasRiddenOff) {
  fallen_.fell_unseen("A", {0.3, 0.2, 0.1}, {0.6, 0.1, 0.9}, 1.2);
  ASSERT_EQ(rooms().size(), 1U);
  EXPECT_EQ(rooms()[0].track, 0U) << "nobody picks it";
  EXPECT_GT(rooms()[0].size_m.x(), 0.4) << "it may have slid";
  EXPECT_EQ(rooms()[0].size_m.z(), 0.3) << "or stand on its end";
  (void)fallen_.recognise({}, 0.5, at(12));
  ASSERT_EQ(rooms().size(), 1U);
  EXPECT_NEAR(rooms()[0].world_from_top.translation().x(), 1.1, 1e-9);
  EXPECT_EQ(rooms()[0].velocity_m_s.x(), 0.2);
  (void)fallen_.recognise({}, 0.2, at(13));
  EXPECT_TRUE(rooms().empty());
  fallen_.fell_unseen("A", {0.3, 0.2, 0.1}, {0.6, 0.1, 0.9}, 1.2);
  fallen_.forget("A");
  EXPECT_TRUE(rooms().empty()) << "a light curtain has counted it";
  fallen_.fell_unseen("A", {0.3, 0.2, 0.1}, {0.6, 0.1, 0.9}, 1.2);
  ObjectBelief read = like_it();
  read.code = "A";
  (void)fallen_.recognise({read}, 0, at(14));
  EXPECT_TRUE(rooms().empty()) << "it bounced back into view";
}

// A light curtain has counted it in a chute.
TEST_F(FallenTest, WhatIsKnownToLieElsewhereIsNotRecognised) {
  falls();
  fallen_.forget("A");
  EXPECT_FALSE(fallen_.awaits("A"));
  EXPECT_EQ(seen({like_it()}), 0);
}

// It bounced or rolled beyond the view.
TEST_F(FallenTest, AwaitedInVainNearTheViewsEndItIsInTheWay) {
  falls();
  EXPECT_EQ(seen({}, 4), 0);
  EXPECT_TRUE(rooms().empty()) << "a camera would have shown it";
  falls();
  (void)fallen_.recognise({}, 0.45, at(11));
  EXPECT_TRUE(rooms().empty());
  EXPECT_EQ(seen({}, 4), 0);
  ASSERT_EQ(rooms().size(), 1U);
  EXPECT_NEAR(rooms()[0].world_from_top.translation().x(), 0.55, 1e-9);
  EXPECT_EQ(rooms()[0].world_from_top.translation().z(), 1.2);
}

// Two sides of a higher one were seen first.
TEST_F(FallenTest, WhatTurnsOutToBeLargerWasMistaken) {
  const auto mistaken = [&](const Vector3& size_m, int frames) {
    ObjectBelief object = box(7, size_m, 0.2);
    object.frames_seen = frames;
    return fallen_.take_mistaken({object});
  };
  falls();
  ASSERT_EQ(seen({like_it()}), 7);
  EXPECT_TRUE(mistaken({0.305, 0.2, 0.2}, 3).empty()) << "not well seen yet";
  EXPECT_TRUE(mistaken({0.305, 0.15, 0.1}, 9).empty()) << "something hides a part of it";
  const auto found = mistaken({0.305, 0.2, 0.2}, 4);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].first, 7U);
  EXPECT_EQ(found[0].second, "A");
  EXPECT_TRUE(mistaken({0.305, 0.2, 0.2}, 5).empty()) << "once";
}

}  // namespace
}  // namespace pons::skills
