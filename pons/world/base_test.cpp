// Worlds with a base.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>

#include "pons/world/test_folder.hpp"
#include "pons/world/world.hpp"

namespace pons::world {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string committed(const std::string& file) {
  std::ifstream stream("worlds/rounds/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class BrokenRounds : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("rounds/scene.xml", "<mujoco/>");
    folder_.write("robots/porter2/porter2.urdf", "<robot/>");
    for (const char* file : {"map.yaml", "map.pgm", "tasks/inspect_warehouse_001.json"})
      folder_.write(std::string("rounds/") + file, committed(file));
    text_ = committed("world.yaml");
    ASSERT_FALSE(text_.empty());
  }
  // The error after the first `from` has become `to`.
  std::string changed(std::string_view from, std::string_view to) {
    std::string text = text_;
    const std::size_t at = text.find(from);
    if (at == std::string::npos) return fmt::format("the text to change is not there: {}", from);
    folder_.write("rounds/world.yaml", text.replace(at, from.size(), to));
    const auto world = load(folder_.path(), "rounds");
    return world ? "no error" : world.error().line();
  }
  TestFolder folder_;
  std::string text_;
};

TEST(Rounds, AreWhatTheFileSays) {
  const auto world = load("worlds", "rounds");
  ASSERT_TRUE(world) << world.error().line();
  ASSERT_TRUE(world->base && world->map);
  EXPECT_EQ(world->base->speed_m_s, 0.5);
  EXPECT_EQ(world->base->station("middle_aisle")->map_from_base, (Pose2{5.6, 0, 0}));
  EXPECT_EQ(world->base->station("nowhere"), nullptr);
  EXPECT_EQ(world->robot.home.size(), 2);
  EXPECT_TRUE(world->robot.flange_link.empty());
  // One drive accelerates a quarter of the mass and what turns: r² (m / 4 + J / w²).
  EXPECT_NEAR(world->robot.reflected_inertia_kg_m2[0], 0.01 * (30.0 / 4 + 1.19 / 0.16), 1e-9);
  ASSERT_EQ(world->cameras.size(), 1U);
  EXPECT_TRUE(world->cameras[0].is_lidar());
  const Intrinsics rays = intrinsics(world->cameras[0]);
  EXPECT_NEAR((359 - rays.cx) / rays.fx - (0 - rays.cx) / rays.fx, 2 * 3.14159265358979 * 359 / 360, 1e-9);
  EXPECT_EQ(world->tasks.size(), 1U);
}

TEST_F(BrokenRounds, EachMistakeIsNamed) {
  EXPECT_EQ(changed("phase_s: 0.0", "phase_s: 0.02"), "no error");
  EXPECT_THAT(changed("map: map.yaml", "map: map.yaml\nbelt: {}"), HasSubstr("has both 'base' and 'belt'"));
  EXPECT_THAT(changed("map: map.yaml\n", ""), HasSubstr("key 'map' is missing"));
  EXPECT_THAT(changed("map: map.yaml", "map: no.yaml"), AllOf(HasSubstr("world.yaml:"), HasSubstr("there is no file")));
  EXPECT_THAT(changed("  payload", "  payload"), HasSubstr("not there"));
  EXPECT_THAT(changed("  urdf:", "  flange_link: x\n  urdf:"), HasSubstr("unknown key"));
  EXPECT_THAT(changed("speed_rad_s: [8.0, 8.0]", "speed_rad_s: [8.0, 8.0, 8.0]"), HasSubstr("speed_rad_s"));
  EXPECT_THAT(changed("speed_rad_s: [8.0, 8.0]", "speed_rad_s: [7.0, 8.0]"),
              HasSubstr("with turn_rad_s a wheel needs 0.74 m/s and has 0.70"));
  EXPECT_THAT(changed("wheel_radius_m: 0.10", "wheel_radius_m: 0"), HasSubstr("base.wheel_radius_m"));
  EXPECT_THAT(changed("wheel_error: [0.015, -0.005]", "wheel_error: [0.2, 0]"), HasSubstr("wheel_error[0]"));
  EXPECT_THAT(changed("start: [0.0, 0.0, 0.0]", "start: [4.5, 1.2, 0.0]"), HasSubstr("no room for the base"));
  EXPECT_THAT(changed("pose: [5.6, 0.0, 0.0]", "pose: [50, 0.0, 0.0]"),
              AllOf(HasSubstr("stations[1].pose"), HasSubstr("no room for the base")));
  EXPECT_THAT(changed("name: south_aisle", "name: dock"), HasSubstr("'dock' is there twice"));
  EXPECT_THAT(changed("fan_deg: 360", "fan_deg: 361"), HasSubstr("fan_deg"));
  EXPECT_THAT(changed("tasks/inspect", "tasks/expect"), HasSubstr("there is no file"));
}

}  // namespace
}  // namespace pons::world
