#include "pons/skills/company.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <optional>
#include <string>

#include "pons/skills/scale.hpp"

namespace pons::skills {
namespace {

ObjectBelief box(std::uint32_t track, const char* code, double x_m, double y_m) {
  ObjectBelief object;
  object.track = track;
  object.code = code;
  object.size_m = {0.2, 0.1, 0.1};
  object.world_from_top.translation() = Vector3(x_m, y_m, 1.0);
  return object;
}

// The view's border cuts it: no track is made of it yet.
ObjectBelief half_seen(double x_m, double y_m) {
  ObjectBelief object = box(0, "", x_m, y_m);
  object.half_seen = true;
  return object;
}

// The tool points down, its x axis along the world's y.
Eigen::Matrix3d turned() {
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return axes;
}

TEST(CompanyTest, IsWhatLiesCloseToIt) {
  const ObjectBelief target = box(1, "A", 0, 0);
  const Company company = company_of(
      target, {target, box(2, "B", 0, 0.13), box(3, "far", 0, 0.15), box(0, "obstacle", 0, -0.11)}, turned());
  ASSERT_EQ(company.size(), 1U) << "three centimetres apart, five, and only something in the way";
  EXPECT_EQ(company[0].code, "B");
  EXPECT_NEAR((company[0].aside_m - Eigen::Vector2d(0.13, 0)).norm(), 0, 1e-12) << "as the tip sees it";
}

// A tube hung on a box that was taken while the tube's end was not in view yet, and fell where nobody looked.
TEST(CompanyTest, MayBeSeenInPart) {
  const ObjectBelief target = box(1, "A", 0, 0);
  const Company company = company_of(target, {target, half_seen(-0.21, 0), half_seen(-0.25, 0)}, turned());
  ASSERT_EQ(company.size(), 1U) << "one centimetre apart, and five";
  EXPECT_NEAR((company[0].aside_m - Eigen::Vector2d(0, -0.21)).norm(), 0, 1e-12);
  const auto beside = hangs_beside({.size_m = {0.31, 0.29, 0.15}}, {1.3, {0, -0.045}}, company, std::nullopt);
  EXPECT_TRUE(beside) << "contents do not lie to one side like that, but near its edge it is not";
  EXPECT_FALSE(hangs_beside({.size_m = {0.31, 0.29, 0.15}}, {1.3, {0, -0.045}}, {}, std::nullopt));
}

class FeltTest : public testing::Test {
 protected:
  // Whose weight, of what hangs so far from the load's middle, tip frame.
  [[nodiscard]] std::string felt(double mass_kg, double x_m, double y_m,
                                 const std::optional<Hooked>& before = {}) const {
    const Weight weight{mass_kg, load_.offset_in_tip_m.head<2>() + Eigen::Vector2d(x_m, y_m)};
    return hangs_beside(load_, weight, company_, before).value_or(Beside{"nobody"}).whose;
  }
  const Load load_{.size_m = {0.3, 0.3, 0.1}, .offset_in_tip_m = {0.02, 0.01, 0}};
  const Company company_{{2, "B", {0.2, 0}}, {3, "C", {0, -0.2}}};
};

TEST_F(FeltTest, TowardsWhomItWeighsMore) {
  EXPECT_EQ(felt(1, 0.03, 0.01), "B");
  EXPECT_EQ(felt(1, 0, -0.03), "C");
  EXPECT_EQ(felt(1, -0.03, 0), "nobody") << "nothing lay there";
  EXPECT_EQ(felt(2.5, 0.007, 0), "nobody") << "so well is a load's middle known";
  EXPECT_EQ(felt(0.2, 0.02, 0), "nobody") << "the wrist does not feel so little";
}

TEST_F(FeltTest, AParcelMayBeUnevenUnlessAnotherHungOnItAndItIsHeavierStill) {
  EXPECT_EQ(felt(1, -0.05, 0), "nobody");
  EXPECT_EQ(felt(1, -0.05, 0, Hooked{"A", 0.5, 0.5}), "another");
  EXPECT_EQ(felt(1, -0.05, 0, Hooked{"A", 1, 1}), "nobody");
  EXPECT_EQ(felt(1, -0.14, 0), "another") << "no parcel is";
}

// Put back because another hung on it, or seemed to.
TEST_F(FeltTest, WhatIsFeltTimeAndAgainIsUneven) {
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 1, 1, 1}), "B") << "it may have hooked again";
  EXPECT_EQ(felt(1, -0.03, 0, Hooked{"A", 1, 1, 2}), "nobody");
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 1, 1, 2}), "B") << "one box may show both codes";
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 1.5, 1.5, 2}), "nobody") << "it came off B";
  EXPECT_EQ(felt(1, 0.05, 0, Hooked{"A", 1, 1, 2}), "B") << "no contents explain it";
  EXPECT_EQ(felt(1, -0.14, 0, Hooked{"A", 1.5, 1.5, 2}), "another") << "no parcel is that uneven";
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 0.8, 0.8, 2}), "B") << "heavier: the neighbour bore a part of it then";
}

// A box that shows two codes was taken for two; it was felt to hang there three times, and then not, by a millimetre.
TEST_F(FeltTest, OneReadingDoesNotPartWhatNeverCameApart) {
  const Hooked thrice{"A", 0.54, 0.55, 3, "B"};
  EXPECT_EQ(felt(0.54, 0.005, 0, thrice), "B");
  EXPECT_EQ(felt(0.35, 0.005, 0, thrice), "nobody") << "B has come off";
  EXPECT_EQ(felt(0.54, 0.005, 0, Hooked{"A", 0.54, 0.55, 1, "B"}), "nobody") << "once proves nothing";
  EXPECT_EQ(felt(0.54, 0.005, 0, Hooked{"A", 0.54, 0.55, 3, "D"}), "nobody") << "D is not there any more";
  const Hooked again = hooked_again({.code = "A"}, 0.5, Beside{"B"}, thrice);
  EXPECT_EQ(again.times, 4);
  EXPECT_EQ(again.most_kg, 0.55);
  EXPECT_EQ(again.whose, "B");
  EXPECT_EQ(hooked_again({.code = "A"}, 0.5, std::nullopt, std::nullopt).whose, "");
}

// A box of 0.46 m, of which 6 cm at one end were hidden when it was measured.
TEST(ReachingTest, WhatANeighbourHidIsFeltByWhereItWeighs) {
  const Load seen{.size_m = {0.40, 0.16, 0.08}, .yaw_in_tip_rad = 0.5 * std::numbers::pi, .offset_in_tip_m = {0, 0, 0}};
  const Load whole = reaching(seen, {0.59, {0, -0.03}});
  EXPECT_NEAR(whole.size_m.x(), 0.46, 1e-9);
  EXPECT_NEAR(whole.size_m.y(), 0.16, 1e-9);
  EXPECT_NEAR(whole.offset_in_tip_m.y(), -0.03, 1e-9) << "its middle is where it weighs";
  EXPECT_NEAR(whole.offset_in_tip_m.x(), 0, 1e-9);
  EXPECT_EQ(reaching(seen, {0.59, {0, -0.007}}).size_m, seen.size_m) << "so well is a load's middle known";
  EXPECT_EQ(reaching(seen, {0.1, {0, -0.03}}).size_m, seen.size_m) << "the wrist does not feel so little";
  EXPECT_EQ(reaching(seen, {0.59, {0, -0.07}}).size_m, seen.size_m) << "a neighbour bears it";
  EXPECT_EQ(reaching(seen, {0.59, {0.03, 0}}).size_m, seen.size_m) << "it goes in lengthwise";
}

TEST_F(FeltTest, WhatIsTooHeavyForItsSizeDoesNotHangAlone) {
  EXPECT_EQ(felt(6, 0, 0), "nobody") << "some are that heavy";
  EXPECT_EQ(felt(6, 0, 0, Hooked{"A", 6, 6, 3}), "another");
}

TEST_F(FeltTest, WhatIsLighterThanWhenAnotherHungOnItIsUneven) {
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 1.3, 1.3, 1}), "nobody") << "that has let go";
  EXPECT_EQ(felt(1, 0.05, 0, Hooked{"A", 1.3, 1.3, 1}), "B") << "it still pulls";
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 1.15, 1.15, 1}), "B") << "it may drag on the belt";
  EXPECT_EQ(felt(1, 0.03, 0, Hooked{"A", 0.6, 1.3, 2}), "B") << "but heavier than the last time";
}

// Nobody has seen who of two was left.
TEST(WhoHungTest, IsAsHeavyAsWhatWasFeltBesideIt) {
  EXPECT_TRUE(may_be_who_hung(0.28, 0.1, {"A", 0.28, 0.47, 2}));
  EXPECT_FALSE(may_be_who_hung(0.19, 0.1, {"A", 0.47, 0.47, 1})) << "both hung there the last time";
  EXPECT_FALSE(may_be_who_hung(0.47, 0.1, {"A", 0.47, 0.47, 2})) << "it is uneven by itself";
}

TEST(WhoHungTest, StandsNoLowerThanItsLeastSide) {
  const Company tall{{2, "B", {0.2, 0}, {0.18, 0.12, 0.3}}}, flat{{2, "B", {0.2, 0}, {0.18, 0.12, 0.03}}};
  const auto once = [](const Company& company) { return hooked_again({.code = "A", .company = company}, 1, {}, {}); };
  EXPECT_DOUBLE_EQ(once(tall).lowest_m, 0.12) << "on whichever face";
  EXPECT_FALSE(may_be_who_hung(0.6, 0.07, hooked_again({.code = "A"}, 0.6, {}, once(tall))));
  EXPECT_TRUE(may_be_who_hung(0.6, 0.13, hooked_again({.code = "A"}, 0.6, {}, once(tall))));
  EXPECT_TRUE(may_be_who_hung(0.6, 0.07, hooked_again({.code = "A", .company = flat}, 0.6, {}, once(tall))));
  EXPECT_TRUE(may_be_who_hung(0.6, 0.07, hooked_again({.code = "A"}, 0.6, {}, {{"A", 1, 1}})))
      << "nobody has measured it";
}

}  // namespace
}  // namespace pons::skills
