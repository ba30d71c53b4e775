#include "pons/perception/tray_watch.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "pons/perception/perception.hpp"
#include "pons/perception/synthetic_camera.hpp"

namespace pons::perception {
namespace {

TEST(TrayTest, CountsWhatFellIntoTheTray) {
  SyntheticBelt belt;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  for (int i = 0; i < 4; ++i) belt.show(perception, "tray");
  EXPECT_EQ(perception.occupancy("tray"), 0);
  belt.things = {{.x_m = -0.4, .size_m = {0.1, 0.08, 0.04}}, {.x_m = 0.1, .size_m = {0.2, 0.2, 0.1}}};
  belt.show(perception, "tray");
  EXPECT_EQ(perception.occupancy("tray"), 2);
  EXPECT_EQ(perception.occupancy("nowhere"), 0);
}

// A tray close below belt and chute, as in a low cell: what is on its ordinary way above it has not fallen.
TEST(TrayTest, OnlyWhatFellCountsAsFallen) {
  SyntheticBelt belt;
  belt.world.places = {
      {"tray", world::PlaceKind::kTray, Vector3(0, 0, 0.35), Vector3(2.6, 1.4, 0.1)},
      {"chute", world::PlaceKind::kChute, Vector3(-0.3, 0.47, 0.87), Vector3(0.38, 0.38, 0.4)},
  };
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  for (int i = 0; i < TrayWatch::kLearn; ++i) belt.show(perception, "tray");
  const Thing rides{.x_m = -0.7, .size_m = {0.2, 0.15, 0.06}};
  const Thing sorted{.x_m = -0.3, .y_m = 0.47, .size_m = {0.2, 0.2, 0.1}, .base_m = -0.4};
  belt.things = {rides, sorted};
  belt.show(perception, "tray");
  EXPECT_EQ(perception.occupancy("tray"), 0);

  const Thing fell{.x_m = -0.9, .y_m = 0.5, .size_m = {0.2, 0.2, 0.1}, .base_m = -0.55};
  const Thing falls{.x_m = -0.5, .y_m = -0.5, .size_m = {0.2, 0.2, 0.1}, .base_m = -0.3};
  belt.things = {rides, sorted, fell, falls};
  belt.show(perception, "tray");
  EXPECT_EQ(perception.occupancy("tray"), 2);
}

// Seen at a flat angle a row of pixels lies centimetres behind the next one, and a quarter of the readings is missing.
TEST(TrayTest, NothingFellWhereTheCameraLooksAlongTheTray) {
  SyntheticBelt belt;
  belt.dropout = 0.25;
  belt.world.places = {{"tray", world::PlaceKind::kTray, Vector3(0, 2.2, 0.05), Vector3(3.0, 2.0, 0.1)}};
  world::CameraSpec& camera = belt.world.cameras.back();
  const Vector3 eye(0, 0.8, 0.6), forward = (Vector3(0, 2.4, 0) - eye).normalized();
  const Vector3 right = forward.cross(Vector3::UnitZ()).normalized();
  camera.world_from_optical.translation() = eye;
  camera.world_from_optical.linear() << right, forward.cross(right), forward;
  camera.width = 160, camera.height = 120, camera.fovy_rad = std::numbers::pi / 6;
  Perception perception(belt.world, model::RobotModel::load(belt.world.robot).value());
  for (int i = 0; i < 60; ++i) {
    belt.show(perception, "tray");
    ASSERT_EQ(perception.occupancy("tray"), 0) << i;
  }
  belt.things = {{.x_m = 0.2, .y_m = 2.2, .size_m = {0.2, 0.2, 0.1}, .base_m = -0.9}};
  belt.show(perception, "tray");
  EXPECT_EQ(perception.occupancy("tray"), 1);
}

}  // namespace
}  // namespace pons::perception
