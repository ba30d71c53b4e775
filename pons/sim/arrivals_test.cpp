#include "pons/sim/arrivals.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace pons::sim {
namespace {

world::World load_cell() {
  auto world = world::load("worlds", "parcel_cell");
  if (!world) throw std::runtime_error(world.error().line());
  return *world;
}

class Mix : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Mix, HoldsTheSharesOfTheWorld) {
  const world::World world = load_cell();
  const auto manifest = world::draw_manifest(world, 2000, GetParam());
  ASSERT_TRUE(manifest);
  const std::vector<Arrival> arrivals = plan_arrivals(world, *manifest, GetParam());
  ASSERT_EQ(arrivals.size(), 2000U);
  const auto share = [&](auto&& is) {
    return static_cast<double>(std::count_if(arrivals.begin(), arrivals.end(), is)) / 2000.0;
  };
  EXPECT_NEAR(share([](const Arrival& a) { return a.touching; }), world.arrivals.touching, 0.01);
  EXPECT_GE(share([](const Arrival& a) { return a.touching; }), 0.2);
  EXPECT_NEAR(share([](const Arrival& a) { return a.label != LabelState::kReadable; }), world.arrivals.unreadable,
              0.012);
}

TEST_P(Mix, TwoHundredParcelsAlreadyTouchEnough) {
  const world::World world = load_cell();
  const auto manifest = world::draw_manifest(world, 200, GetParam());
  ASSERT_TRUE(manifest);
  const auto arrivals = plan_arrivals(world, *manifest, GetParam());
  EXPECT_GE(std::count_if(arrivals.begin(), arrivals.end(), [](const Arrival& a) { return a.touching; }), 40);
}

TEST_P(Mix, EverythingFitsBetweenTheBeltsEdges) {
  const world::World world = load_cell();
  const auto manifest = world::draw_manifest(world, 500, GetParam());
  ASSERT_TRUE(manifest);
  const auto arrivals = plan_arrivals(world, *manifest, GetParam());
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const Vector3 at = arrivals[i].group_from_middle.translation();
    EXPECT_LE(std::abs(at.y()), 0.5 * world.belt.width_m - 0.02) << i;
    EXPECT_GE(at.z(), 0.4 * (*manifest)[i].size_m.minCoeff()) << i;
    EXPECT_LE(at.x(), 0) << i;
    EXPECT_LT(arrivals[i].group_length_m, 1.3) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Mix, testing::Values(1, 2, 3));

TEST(Arrivals, DependOnSeedAndIndexNotOnWhatFollows) {
  const world::World world = load_cell();
  const auto manifest = world::draw_manifest(world, 60, 4);
  ASSERT_TRUE(manifest);
  const auto all = plan_arrivals(world, *manifest, 9);
  const auto some = plan_arrivals(world, world::Manifest(manifest->begin(), manifest->begin() + 40), 9);
  for (std::size_t i = 0; i < 36; ++i) {
    EXPECT_EQ(all[i].label_text, some[i].label_text);
    EXPECT_EQ(all[i].group_from_middle.matrix(), some[i].group_from_middle.matrix());
  }
}

}  // namespace
}  // namespace pons::sim
