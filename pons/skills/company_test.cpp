#include "pons/skills/company.hpp"

#include <gtest/gtest.h>

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

class FeltTest : public testing::Test {
 protected:
  // Hangs so far from the load's middle, tip frame.
  [[nodiscard]] const Companion* felt(double mass_kg, double x_m, double y_m) const {
    return felt_on(load_, {mass_kg, load_.offset_in_tip_m.head<2>() + Eigen::Vector2d(x_m, y_m)}, company_);
  }
  const Load load_{.size_m = {0.3, 0.3, 0.1}, .offset_in_tip_m = {0.02, 0.01, 0}};
  const Company company_{{2, "B", {0.2, 0}}, {3, "C", {0, -0.2}}};
};

TEST_F(FeltTest, TowardsWhomItWeighsMore) {
  ASSERT_NE(felt(1, 0.03, 0.01), nullptr);
  EXPECT_EQ(felt(1, 0.03, 0.01)->code, "B");
  EXPECT_EQ(felt(1, 0, -0.03)->code, "C");
  EXPECT_EQ(felt(1, -0.03, 0), nullptr) << "nothing lay there";
  EXPECT_EQ(felt(2.5, 0.008, 0), nullptr) << "so well is a load's middle known";
  EXPECT_EQ(felt(0.2, 0.02, 0), nullptr) << "the wrist does not feel so little";
}

TEST_F(FeltTest, AParcelMayBeUnevenUnlessAnotherHungOnItBefore) {
  const Weight uneven{1, load_.offset_in_tip_m.head<2>() + Eigen::Vector2d(-0.05, 0)};
  EXPECT_FALSE(hangs_beside(load_, uneven, Uneven::kUsual));
  EXPECT_TRUE(hangs_beside(load_, uneven, Uneven::kDoubted));
  const Weight beyond{1, load_.offset_in_tip_m.head<2>() + Eigen::Vector2d(-0.14, 0)};
  EXPECT_TRUE(hangs_beside(load_, beyond, Uneven::kUsual)) << "no parcel is";
}

TEST(StraysTest, WhoWasCompanyAndIsNotSeenAgainWentTheSameWay) {
  Strays strays;
  const auto at = [](double s) { return Time(from_s(s)); };
  strays.let_go({{2, "B", {0.2, 0}}, {3, "C", {0, 0.2}}, {4, "", {0.2, 0.2}}}, "chute_1", at(10));
  ObjectBelief coasting = box(2, "B", 0, 0), seen = box(3, "C", 0, 0);
  coasting.last_seen = at(9.9);
  seen.last_seen = at(10.1);
  strays.look({coasting, seen}, 1);
  ASSERT_NE(strays.place_of("B"), nullptr) << "seen last before it was lifted";
  EXPECT_EQ(*strays.place_of("B"), "chute_1");
  EXPECT_EQ(strays.place_of("C"), nullptr) << "it has stayed";
  EXPECT_FALSE(strays.missed_twice("B")) << "a grasp may fail";
  EXPECT_TRUE(strays.missed_twice("B"));
  EXPECT_FALSE(strays.missed_twice("C") || strays.missed_twice("C"));
  EXPECT_EQ(strays.place_of("D"), nullptr);
  EXPECT_EQ(strays.place_of(""), nullptr);
}

// A track may be lost and found again under another number.
TEST(StraysTest, WhoWasCompanyTwiceWentWithTheLast) {
  Strays strays;
  strays.let_go({{2, "B", {0, 0}}}, "chute_1", Time(from_s(10)));
  strays.let_go({{7, "B", {0, 0}}}, "chute_2", Time(from_s(20)));
  ASSERT_NE(strays.place_of("B"), nullptr);
  EXPECT_EQ(*strays.place_of("B"), "chute_2");
}

// Whether anybody still asks for it or not.
TEST(StraysTest, WhoIsBelievedNowhereAnyMoreHasGone) {
  Strays strays;
  const auto let_go = Time(from_s(10));
  strays.let_go({{2, "B", {0, 0}}, {3, "", {0, 0}}, {4, "leaves", {0, 0}}, {5, "taken", {0, 0}}}, "chute_1", let_go);
  const ObjectBelief b = box(2, "B", 0.5, 0), unread = box(3, "", 0.5, 0.3);
  const ObjectBelief leaves = box(4, "leaves", 1.1, 0), taken = box(5, "taken", 0.5, -0.3);
  strays.look({b, unread, leaves, taken}, 1);
  EXPECT_TRUE(strays.take_found_gone().empty()) << "a camera may have been hidden from them";
  strays.taken(5);
  strays.look({unread}, 1);
  const std::vector<Stray> first = strays.take_found_gone();
  ASSERT_EQ(first.size(), 1U) << "one is beyond the view, one was picked by itself";
  EXPECT_EQ(first[0].code, "B");
  EXPECT_EQ(first[0].place, "chute_1");
  strays.look({}, 1);
  const std::vector<Stray> second = strays.take_found_gone();
  ASSERT_EQ(second.size(), 1U) << "each once";
  EXPECT_EQ(second[0].code, "");
  ASSERT_NE(strays.place_of("B"), nullptr) << "its own task, if it comes, says so, too";
}

}  // namespace
}  // namespace pons::skills
