#include "pons/world/mouth.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pons::world {
namespace {

std::vector<Entry> ways(double length_m, double width_m, double height_m) {
  const Place mouth{.name = "chute", .kind = PlaceKind::kChute, .size_m = {0.38, 0.40, 0.45}};
  return ways_in({length_m, width_m, height_m}, mouth);
}

TEST(WaysIn, WhatIsShorterThanTheMouthGoesInLevel) {
  for (const auto& [side, height] : {std::pair{0.08, 0.08}, {0.25, 0.30}, {0.33, 0.30}, {0.35, 0.20}, {0.37, 0.02}}) {
    ASSERT_EQ(ways(side, side, height).size(), 1U) << side;
    EXPECT_EQ(ways(side, side, height).front().lean_rad, 0) << side;
    EXPECT_FALSE(ways(side, side, height).front().across_corners) << side;
  }
}

TEST(WaysIn, ALongFlatOneLeansSteeplyFirst) {
  for (const Vector3& size : {Vector3(0.40, 0.30, 0.03), Vector3(0.30, 0.40, 0.03)}) {
    const auto found = ways(size.x(), size.y(), size.z());
    ASSERT_EQ(found.size(), 2U);
    EXPECT_GT(found[0].lean_rad, found[1].lean_rad);
    EXPECT_GT(found[1].lean_rad, 0);
  }
}

TEST(WaysIn, LeaningItIsNoLongerAtTheRimThanTheMouth) {
  for (const double height_m : {0.02, 0.05, 0.09, 0.12}) {
    const auto found = ways(0.40, 0.34, height_m);
    ASSERT_FALSE(found.empty()) << height_m;
    for (const Entry& entry : found) EXPECT_LT(height_m / std::sin(entry.lean_rad), 0.31) << height_m;
  }
}

TEST(WaysIn, ANarrowOneAlsoGoesInAlongTheDiagonal) {
  EXPECT_TRUE(ways(0.40, 0.08, 0.08).back().across_corners);
  ASSERT_EQ(ways(0.36, 0.12, 0.25).size(), 1U);  // too high to lean
  EXPECT_TRUE(ways(0.36, 0.12, 0.25).back().across_corners);
  EXPECT_FALSE(ways(0.40, 0.16, 0.10).back().across_corners);
}

TEST(WaysIn, WhatIsTooWideOrTooHighToLeanHasNone) {
  EXPECT_TRUE(ways(0.39, 0.39, 0.05).empty());
  EXPECT_TRUE(ways(0.374, 0.373, 0.05).empty());
  EXPECT_TRUE(ways(0.39, 0.30, 0.15).empty());
  EXPECT_TRUE(ways(0.36, 0.30, 0.30).empty());
  EXPECT_TRUE(ways(0.345, 0.345, 0.30).empty());
}

TEST(MouthsNear, AreThoseWithinReachOfThePoint) {
  const auto world = load("worlds", "parcel_cell");
  ASSERT_TRUE(world);
  using Names = std::vector<std::string>;
  EXPECT_EQ(mouths_near(*world, Vector3(0.20, 0.46, 2), 0), Names{"chute_1"});
  EXPECT_EQ(mouths_near(*world, Vector3(0.03, 0.46, 0.9), 0.05), (Names{"chute_1", "chute_2"}));
  EXPECT_EQ(mouths_near(*world, Vector3(0.3, 0, 0.9), 0.1), Names{}) << "over the belt";
  EXPECT_EQ(mouths_near(*world, Vector3(1.2, 0, 0.9), 0), Names{"exception"});
}

}  // namespace
}  // namespace pons::world
