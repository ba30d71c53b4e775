#include "pons/skills/mouths.hpp"

#include <gtest/gtest.h>

namespace pons::skills {
namespace {

Time at(double s) { return Time(from_s(s)); }

class MouthsTest : public testing::Test {
 protected:
  MouthsTest() {
    world_.places = {{.name = "chute_1", .kind = world::PlaceKind::kChute},
                     {.name = "chute_2", .kind = world::PlaceKind::kChute},
                     {.name = "exception", .kind = world::PlaceKind::kException}};
    EXPECT_TRUE(fallen(0).empty()) << "what fell before nobody asks";
  }
  std::vector<std::string> fallen(double s) {
    std::vector<std::string> names;
    for (const world::Place* const place : mouths_.unexpected(falls_, at(s))) names.push_back(place->name);
    return names;
  }
  world::World world_;
  Falls falls_{5, 65535, 2};
  Mouths mouths_{world_};
};

using Names = std::vector<std::string>;

TEST_F(MouthsTest, WhatWasLetGoOfIsExpectedOnce) {
  mouths_.expect_at("chute_1", "A", at(1));
  ++falls_[0];
  EXPECT_EQ(fallen(1.2), Names{});
  ++falls_[0];
  EXPECT_EQ(fallen(1.3), Names{"chute_1"}) << "another came along";
  mouths_.expect_at("chute_1", "A", at(2));
  ++falls_[1];  // its count begins anew
  EXPECT_EQ(fallen(2.2), Names{"chute_2"}) << "not where it was let go of";
  falls_[0] += 2;
  EXPECT_EQ(fallen(2.3), Names{"chute_1"}) << "one of the two";
}

TEST_F(MouthsTest, WhatIsNotCountedIsToldOnce) {
  mouths_.expect_at("chute_1", "A", at(1));
  mouths_.expect_at("chute_2", "B", at(1.2));
  mouths_.expect_at("exception", "C", at(1.2));
  ++falls_[1];
  EXPECT_EQ(fallen(2.4), Names{});
  EXPECT_TRUE(mouths_.take_uncounted(at(2.4)).empty()) << "it may lie on the rim";
  EXPECT_EQ(fallen(2.6), Names{});
  const auto uncounted = mouths_.take_uncounted(at(2.6));
  ASSERT_EQ(uncounted.size(), 1U);
  EXPECT_EQ(uncounted[0].code, "A");
  EXPECT_EQ(uncounted[0].let_go, at(1));
  EXPECT_TRUE(mouths_.take_uncounted(at(3)).empty());
}

TEST_F(MouthsTest, WhatIsLostOnItsWayMayFallAnywhereForAWhile) {
  mouths_.expect_anywhere(at(1));
  ++falls_[2];
  EXPECT_EQ(fallen(1.1), Names{"exception"}) << "that rode there";
  ++falls_[1];
  EXPECT_EQ(fallen(1.2), Names{});
  mouths_.expect_anywhere(at(3));
  ++falls_[0];
  EXPECT_EQ(fallen(5), Names{"chute_1"}) << "too late for it";
  mouths_.expect_anywhere(at(6));
  mouths_.expect_no_more();
  ++falls_[1];
  EXPECT_EQ(fallen(6.1), Names{"chute_2"});
}

}  // namespace
}  // namespace pons::skills
