#include "pons/model/collision.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "pons/core/random.hpp"

namespace pons::model {
namespace {

using ::testing::HasSubstr;

class Collision : public ::testing::TestWithParam<const char*> {
 protected:
  static Box box(const Vector3& middle, const Vector3& size_m) {
    Box result{.size_m = size_m};
    result.world_from_box.translation() = middle;
    return result;
  }
  AxisVector draw(Random& random, double range_rad) {
    AxisVector q(model_.axes());
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      q[i] = random.uniform(std::max(-range_rad, robot_.limits.position_min[i]),
                            std::min(range_rad, robot_.limits.position_max[i]));
    }
    return q;
  }

  const world::Robot robot_ = world::load("worlds", GetParam()).value().robot;
  RobotModel model_ = RobotModel::load(robot_).value();
};

TEST_P(Collision, AtHomeNothingTouchesAndOnlyCoarseCapsulesAreLeftOut) {
  CollisionModel model(model_.copy(), {.self_m = 0.005});
  EXPECT_EQ(model.touching(robot_.home), "");
  EXPECT_TRUE(model.clear(robot_.home));
  EXPECT_LE(model.left_out().size(), 2U);
  Random random(1);
  int clear = 0;
  for (int i = 0; i < 500; ++i) {
    const AxisVector q = draw(random, 3.1);
    EXPECT_EQ(model.clear(q), model.touching(q).empty());
    clear += model.clear(q) ? 1 : 0;
  }
  EXPECT_GT(clear, 200);
  EXPECT_LT(clear, 480) << "some postures fold the arm onto itself";
}

TEST_P(Collision, ABoxAtTheToolTouchesAndOneBesideItDoesNot) {
  CollisionModel model(model_.copy(), {.scene_m = 0.01});
  const Vector3 tip = model_.world_from_tip(robot_.home).translation();
  model.surround(std::array{box(tip, {0.1, 0.1, 0.1})});
  EXPECT_FALSE(model.clear(robot_.home));
  EXPECT_THAT(model.touching(robot_.home), HasSubstr("and box 1"));
  // Ahead of the tool, whose farthest capsule ends 3 mm beyond the tip.
  const auto ahead_of_tool = [&](double gap_m) {
    Box ahead{.world_from_box = model_.world_from_tip(robot_.home), .size_m = {0.1, 0.1, 0.1}};
    ahead.world_from_box.translate(Vector3(0, 0, 0.003 + gap_m + 0.05));
    return ahead;
  };
  model.surround(std::array{ahead_of_tool(0.02)});
  EXPECT_TRUE(model.clear(robot_.home));
  EXPECT_NEAR(model.clearance(robot_.home), 0.01, 1e-4);
  model.surround(std::array{ahead_of_tool(0.005)});
  EXPECT_FALSE(model.clear(robot_.home)) << "nearer than the margin";
}

TEST_P(Collision, ALoadReachesFartherThanTheTool) {
  CollisionModel model(model_.copy(), {.load_m = 0});
  const Pose home = model_.world_from_tip(robot_.home);
  model.surround(std::array{box(home * Vector3(0, 0, 0.15), {0.02, 0.02, 0.02})});
  ASSERT_TRUE(model.clear(robot_.home));
  CarriedBox load{.size_m = {0.1, 0.1, 0.2}};
  load.tip_from_box.translation().z() = 0.1;
  model.carry(load);
  EXPECT_FALSE(model.clear(robot_.home));
  EXPECT_EQ(model.touching(robot_.home), "the load and box 1");
  model.carry({});
  EXPECT_TRUE(model.clear(robot_.home));
  // One so large that it reaches back to the arm.
  model.surround({});
  load.size_m = {1.2, 1.2, 1.2};
  model.carry(load);
  EXPECT_THAT(model.touching(robot_.home), HasSubstr("and the load"));
}

// Who judges only what stands around asks for no more.
TEST_P(Collision, WithoutMarginsLinksAndLoadAreNotHeldApart) {
  CollisionModel strict(model_.copy(), {.self_m = 0.0, .load_m = 0.0}), scene(model_.copy(), {});
  CarriedBox load{.size_m = {1.2, 1.2, 1.2}};
  Random random(1);
  int folded = 0;
  for (int i = 0; i < 200; ++i) {
    const AxisVector q = draw(random, 3.1);
    folded += strict.clear(q) ? 0 : 1;
    EXPECT_TRUE(scene.clear(q));
  }
  EXPECT_GT(folded, 5);
  strict.carry(load);
  scene.carry(load);
  EXPECT_FALSE(strict.clear(robot_.home));
  EXPECT_TRUE(scene.clear(robot_.home));
  EXPECT_EQ(scene.touching(robot_.home), "");
}

// Both ends clear, something thin between them: the line is refused, and what is accepted is clear at every posture.
TEST_P(Collision, NothingThinIsJumpedOver) {
  const CollisionMargins margins{.scene_m = 0.01};
  CollisionModel model(model_.copy(), margins);
  const Vector3 base = robot_.world_from_base.translation();
  Random random(2);
  int refused = 0, accepted = 0;
  for (int i = 0; i < 500; ++i) {
    const double angle = random.uniform(-3, 3), far_m = random.uniform(0.35, 0.7);
    const Vector3 post(base.x() + far_m * std::cos(angle), base.y() + far_m * std::sin(angle), base.z());
    model.surround(std::array{box(post, {0.004, 0.004, 0.8})});
    const AxisVector a = robot_.home + 0.5 * draw(random, 1.5), b = robot_.home + 0.5 * draw(random, 1.5);
    if (!model.clear(a) || !model.clear(b)) continue;
    double least = 1;
    for (int k = 0; k <= 400; ++k) least = std::min(least, model.clearance(a + k / 400.0 * (b - a)));
    if (model.clear(a, b)) {
      ++accepted;
      EXPECT_GE(least, -0.5 * CollisionModel::kStep_m) << i;
    } else {
      ++refused;
      EXPECT_LT(least, 0.005) << i;
    }
  }
  EXPECT_GT(refused, 5);
  EXPECT_GT(accepted, 10);
}

// The bound on how far any point moves, on which that rests.
TEST_P(Collision, NoPointMovesFartherThanTravelSays) {
  const CollisionModel model(model_.copy(), {});
  Random random(3);
  std::vector<PlacedCapsule> at_a, at_b;
  for (int i = 0; i < 500; ++i) {
    const AxisVector a = draw(random, 3), b = a + 0.05 * draw(random, 3);
    model_.place_capsules(a, at_a);
    model_.place_capsules(b, at_b);
    double most = 0;
    for (std::size_t k = 0; k < at_a.size(); ++k) {
      most = std::max({most, (at_a[k].from - at_b[k].from).norm(), (at_a[k].to - at_b[k].to).norm()});
    }
    EXPECT_LE(most, model.travel(a, b));
    EXPECT_GT(most, 0.05 * model.travel(a, b)) << "or the bound is worthless";
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, Collision, ::testing::Values("parcel_cell", "small_cell"));

}  // namespace
}  // namespace pons::model
