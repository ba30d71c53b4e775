#include "apps/views/low_level_view.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace pons::apps {
namespace {

TEST(LowLevelView, APoseIsSixNumbers) {
  Pose pose = Pose::Identity();
  pose.translation() = Vector3(1, 2, 3);
  pose.linear() = (Eigen::AngleAxisd(0.3, Vector3::UnitZ()) * Eigen::AngleAxisd(-0.2, Vector3::UnitY()) *
                   Eigen::AngleAxisd(2.9, Vector3::UnitX()))
                      .toRotationMatrix();
  const auto six = six_numbers(pose);
  const std::array expected{1.0, 2.0, 3.0, 2.9, -0.2, 0.3};
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(six[i], expected[i], 1e-12) << i;
}

TEST(LowLevelView, ATaskHasTheNumberThatItsIdEndsIn) {
  EXPECT_EQ(task_number("17"), 17U);
  EXPECT_EQ(task_number("high_level:18446744073709551615"), 18446744073709551615U);
  for (const char* id : {"", "P000123", "high_level:", "high_level:99999999999999999999", "1a", "-1"})
    EXPECT_EQ(task_number(id), 0U) << id;
}

}  // namespace
}  // namespace pons::apps
