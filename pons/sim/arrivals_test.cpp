#include "pons/sim/arrivals.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

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
    const Eigen::Matrix3d turn = arrivals[i].group_from_middle.linear();
    const double half_m = 0.5 * turn.row(1).cwiseAbs().dot((*manifest)[i].size_m);
    EXPECT_LE(std::abs(at.y()) + half_m, std::max(half_m, 0.5 * world.belt.width_m)) << i;
    EXPECT_GE(at.z(), 0.4 * (*manifest)[i].size_m.minCoeff()) << i;
    EXPECT_LE(at.x(), 0) << i;
    EXPECT_LT(arrivals[i].group_length_m, 1.3) << i;
  }
}

// Seen from above, with sides along the same direction; what leans lies on the one before it.
TEST_P(Mix, NothingIsPutDownIntoAnother) {
  const world::World world = load_cell();
  const auto manifest = world::draw_manifest(world, 2000, GetParam());
  ASSERT_TRUE(manifest);
  const auto arrivals = plan_arrivals(world, *manifest, GetParam());
  int pairs = 0;
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const Pose& one = arrivals[i].group_from_middle;
    for (std::size_t next = i; next > 0 && arrivals[next - 1].group == arrivals[i].group; --next) {
      const std::size_t j = next - 1;
      const Pose& other = arrivals[j].group_from_middle;
      const bool leans = std::abs(one.linear()(2, 2)) < 0.999;
      if (leans && j + 1 == i) continue;
      const Eigen::Rotation2Dd turn(std::atan2(one.linear()(1, 0), one.linear()(0, 0)));
      const Eigen::Vector2d apart = (turn.inverse() * (one.translation() - other.translation()).head<2>()).cwiseAbs();
      const Eigen::Vector2d touching = 0.5 * ((*manifest)[i].size_m + (*manifest)[j].size_m).head<2>();
      EXPECT_TRUE(apart.x() > touching.x() - 0.002 || apart.y() > touching.y() - 0.002) << i << " in " << j;
      ++pairs;
    }
  }
  EXPECT_GT(pairs, 200);
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
