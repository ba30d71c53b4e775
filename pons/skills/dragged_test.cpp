#include "pons/skills/dragged.hpp"

#include <gtest/gtest.h>

namespace pons::skills {
namespace {

constexpr double kBeltEnds_m = 1.5, kBy_m = 0.2;
const Company kCompany{{5, "P5", {0.3, 0}}};

ObjectBelief thing(std::uint32_t track, double x_m, double seen_s, std::string code = {}) {
  ObjectBelief object;
  object.track = track;
  object.code = std::move(code);
  object.size_m = {0.3, 0.2, 0.19};
  object.world_from_top.translation() = Vector3(x_m, 0, 1.09);
  object.last_seen = Time(from_s(seen_s));
  return object;
}

class DraggedTest : public ::testing::Test {
 protected:
  void SetUp() override { dragged_.put_back(kCompany, kBy_m, {thing(5, -0.9, 1, "P5")}, Time(from_s(2))); }
  std::vector<ObjectBelief> in_the_way(const std::vector<ObjectBelief>& believed, double rode_m = 0) {
    dragged_.look(believed, rode_m, kBeltEnds_m);
    std::vector<ObjectBelief> rooms;
    dragged_.add_unseen(rooms, 0.3, Time(from_s(3)));
    return rooms;
  }
  Dragged dragged_;
};

// Whatever the view's border cuts, and whatever room may be taken, has none either: none of these is what hung there.
TEST_F(DraggedTest, WhoHasNoTrackIsNotLookedFor) {
  dragged_ = {};
  dragged_.put_back({{0, "", {0.3, 0}}}, kBy_m, {thing(0, -0.9, 1)}, Time(from_s(2)));
  EXPECT_TRUE(in_the_way({}).empty());
}

TEST_F(DraggedTest, WhoIsNotSeenWhereItLayIsInTheWayFurtherOn) {
  EXPECT_TRUE(in_the_way({thing(5, -0.9, 1, "P5")}).empty()) << "believed there, it is in the way anyhow";
  const auto rooms = in_the_way({}, 0.1);
  ASSERT_EQ(rooms.size(), 1U);
  EXPECT_EQ(rooms[0].track, 0U);
  EXPECT_TRUE(rooms[0].code.empty());
  EXPECT_DOUBLE_EQ(rooms[0].velocity_m_s.x(), 0.3);
  const double middle_m = rooms[0].world_from_top.translation().x(), half_m = 0.5 * rooms[0].size_m.x();
  EXPECT_NEAR(middle_m - half_m, -0.9 - 0.15 + 0.1, 1e-9);
  EXPECT_NEAR(middle_m + half_m, -0.9 + 0.15 + kBy_m + 0.1, 1e-9);
  EXPECT_NEAR(rooms[0].size_m.y(), 0.2, 1e-9);
  EXPECT_NEAR(rooms[0].world_from_top.translation().z(), 1.09, 1e-9) << "as high as it is";
  EXPECT_EQ(in_the_way({}, 2.2).size(), 1U) << "its hindmost still lies there";
  EXPECT_TRUE(in_the_way({}, 0.4).empty()) << "it has ridden off";
}

TEST_F(DraggedTest, WhoIsSeenIsNoLongerInDoubt) {
  EXPECT_TRUE(in_the_way({thing(5, -0.9, 2.5, "P5")}).empty()) << "where it lay";
  EXPECT_TRUE(in_the_way({}).empty());
  SetUp();
  EXPECT_EQ(in_the_way({}).size(), 1U);
  EXPECT_TRUE(in_the_way({thing(9, 0.4, 2.5, "P5")}).empty()) << "by its label, elsewhere";
  SetUp();
  EXPECT_EQ(in_the_way({thing(9, -0.3, 2.5)}).size(), 1U) << "another, that lies elsewhere";
  EXPECT_EQ(in_the_way({thing(9, -0.7, 1.5)}).size(), 1U) << "seen before";
  EXPECT_TRUE(in_the_way({thing(9, -0.7, 2.5)}).empty()) << "unread, in its place";
}

TEST_F(DraggedTest, WhatWasHardlyCarriedLiesWhereItLay) {
  Dragged dragged;
  dragged.put_back(kCompany, 0.02, {thing(5, -0.9, 1, "P5")}, Time(from_s(2)));
  dragged.look({}, 0, kBeltEnds_m);
  std::vector<ObjectBelief> rooms;
  dragged.add_unseen(rooms, 0.3, Time(from_s(3)));
  EXPECT_TRUE(rooms.empty());
}

}  // namespace
}  // namespace pons::skills
