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

TEST_P(Collision, Probe) {
  CollisionModel model(model_.copy(), {});
  for (auto [a, b] : model.left_out()) {
    std::printf("left out %zu %s, %zu %s\n", a, robot_.capsules[a].link.c_str(), b, robot_.capsules[b].link.c_str());
  }
  Random random(1);
  int clear = 0;
  std::map<std::string, int> why;
  for (int i = 0; i < 2000; ++i) {
    const AxisVector q = draw(random, 3.14159);
    if (model.clear(q))
      ++clear;
    else
      ++why[model.touching(q)];
  }
  std::printf("clear %d of 2000; home %s\n", clear, model.touching(robot_.home).c_str());
  for (auto& [k, n] : why) std::printf("  %d %s\n", n, k.c_str());
}

INSTANTIATE_TEST_SUITE_P(Worlds, Collision, ::testing::Values("parcel_cell", "small_cell"));

}  // namespace
}  // namespace pons::model
