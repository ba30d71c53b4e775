#include "pons/sim/base_simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "pons/body/conformance.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

world::World rounds() {
  auto world = world::load("worlds", "rounds");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

// A day of standing, with half a minute's drive in each hour.
TEST(BaseWay, OfWhatIsLongAgoItKnowsWhereItStood) {
  constexpr Duration kApart = std::chrono::milliseconds(10);
  constexpr std::int64_t kHour = 360'000, kDrives = 3000;  // places
  BaseWay way;
  const auto place = [&](std::int64_t i) {
    const std::int64_t driven = i / kHour * kDrives + std::min(i % kHour, kDrives);
    const double tremble_m = 1e-6 * static_cast<double>(i % 3);
    const double driven_m = 0.005 * static_cast<double>(driven);
    return BasePlace{Time(i * kApart), {driven_m + tremble_m, 0, 0.3}};
  };
  constexpr std::int64_t kDay = 24 * kHour;
  EXPECT_FALSE(way.at(Time{}));
  for (std::int64_t i = 0; i < kDay; ++i) way.add(place(i));
  EXPECT_LT(way.size(), BaseWay::kWhole / kApart + 30);
  for (const std::int64_t i : {kDrives + 1, kHour - 1, kHour + kDrives, 20 * kHour + 5000}) {
    ASSERT_TRUE(way.at(Time(i * kApart)));
    EXPECT_NEAR(way.at(Time(i * kApart))->x, place(i).map_from_base.x, 1e-3) << i;
  }
  const std::int64_t lately = kDay - 1000;
  EXPECT_EQ(way.at(Time(lately * kApart) + Duration(1))->x, place(lately).map_from_base.x) << "exact";
}

class OnItsFloor : public ::testing::Test {
 protected:
  // Both wheels follow these speeds (rad/s) for so long.
  void drive(double left, double right, double seconds) {
    const Time end = now_ + from_s(seconds);
    body::Sensors sensors;
    while (now_ < end) {
      now_ += std::chrono::milliseconds(1);
      simulation_->advance_to(now_);
      simulation_->body().read(sensors);
      AxisVector wanted(2);
      wanted << left, right;
      const AxisVector torque = (2.0 * (wanted - sensors.speed)).cwiseMin(8).cwiseMax(-8);
      simulation_->body().write({.torque_nm = torque, .power = true});
    }
  }
  const BaseTruth& truth() { return truth_of(*simulation_); }

  world::World world_ = rounds();
  std::unique_ptr<BaseSimulation> simulation_ = BaseSimulation::create(world_, 1).value();
  Time now_;
};

TEST_F(OnItsFloor, DrivesAlongWhatItsRealWheelsRoll) {
  drive(2, 2, 6);
  body::Sensors sensors;
  simulation_->body().read(sensors);
  const Pose2 at = truth().way.lately().back().map_from_base;
  const double rolled = 0.1 * sensors.position.mean();
  EXPECT_NEAR(truth().driven_m, rolled * 1.005, 0.01) << "its wheels are 1.5 % larger and 0.5 % smaller than drawn";
  // The larger left wheel turns it to the right: by the difference of what both rolled, over the track.
  EXPECT_NEAR(at.yaw, 0.1 * (0.995 * sensors.position[1] - 1.015 * sensors.position[0]) / 0.4, 0.01);
  EXPECT_LT(at.yaw, -0.03);
  EXPECT_EQ(truth().collisions, 0);
}

TEST_F(OnItsFloor, ItsLidarMeasuresTheWalls) {
  simulation_->advance_to(Time(std::chrono::milliseconds(100)));
  body::Camera* const lidar = simulation_->cameras().front();
  lidar->begin(Time(std::chrono::milliseconds(100)));
  RgbdFrame frame;
  ASSERT_TRUE(lidar->finish(frame));
  ASSERT_EQ(frame.depth_m.size(), 360U);
  // From (0.05, 0): the west wall at x = -1 behind it, the map's walls all round.
  int right = 0, seen = 0;
  for (std::size_t i = 0; i < 360; ++i) {
    const double angle = (static_cast<double>(i) - frame.intrinsics.cx) / frame.intrinsics.fx;
    const double range = frame.depth_m[i];
    if (range == 0 || std::isinf(range)) continue;
    ++seen;
    const Vector2 end = Vector2(0.05, 0) + range * Vector2(std::cos(angle), std::sin(angle));
    right += std::abs(world_.map->distance_m(end)) < 0.05 ? 1 : 0;
  }
  EXPECT_GT(seen, 330);
  EXPECT_LT(seen, 360) << "some rays are lost";
  EXPECT_GT(right, seen * 9 / 10) << "all but those that meet the crate end on the map";
  EXPECT_LT(right, seen) << "the crate is not on the map";
  const float noisy = frame.depth_m[180];
  lidar->begin(Time(std::chrono::milliseconds(200)));
  ASSERT_TRUE(lidar->finish(frame));
  EXPECT_NE(frame.depth_m[180], noisy);
}

TEST_F(OnItsFloor, ItsLidarTellsWhatIsFarFromWhatIsLost) {
  world_.cameras.front().range_m = 2;
  simulation_ = BaseSimulation::create(world_, 1).value();
  simulation_->advance_to(Time(std::chrono::milliseconds(100)));
  body::Camera* const lidar = simulation_->cameras().front();
  lidar->begin(Time(std::chrono::milliseconds(100)));
  RgbdFrame frame;
  ASSERT_TRUE(lidar->finish(frame));
  int far = 0, lost = 0;
  for (std::size_t i = 0; i < 360; ++i) {
    const double angle = (static_cast<double>(i) - frame.intrinsics.cx) / frame.intrinsics.fx;
    lost += frame.depth_m[i] == 0 ? 1 : 0;
    if (!std::isinf(frame.depth_m[i])) continue;
    ++far;
    // Nothing of the map is within its range there.
    for (double range = 0.1; range < 1.9; range += 0.1)
      EXPECT_GT(world_.map->distance_m(Vector2(0.05 + range * std::cos(angle), range * std::sin(angle))), 0) << angle;
  }
  EXPECT_GT(far, 30);
  EXPECT_GT(lost, 0);
  EXPECT_LT(lost, 30);
}

TEST_F(OnItsFloor, WithoutPowerItsBrakesHoldIt) {
  drive(3, 3, 2);
  now_ += std::chrono::seconds(2);
  simulation_->body().write({.torque_nm = AxisVector::Zero(2), .power = false});
  simulation_->advance_to(now_);
  const Pose2 at = truth().way.lately().back().map_from_base;
  simulation_->advance_to(now_ + std::chrono::seconds(2));
  EXPECT_NEAR(truth().way.lately().back().map_from_base.x, at.x, 1e-3);
}

TEST_F(OnItsFloor, KeepsTheContractOfABody) {
  const Time settled(std::chrono::seconds(1));  // onto its wheels, which are not as drawn
  simulation_->advance_to(settled);
  body::Subject subject{.body = simulation_->body(),
                        .advance = [this](Time now) { simulation_->advance_to(now); },
                        .cups_on = [] { return 0U; },
                        .push_nm = AxisVector::Constant(2, 2),
                        .now = settled};
  std::vector<std::string> findings = body::nonconformities(subject);
  // A base has no cups that could keep on what they were told.
  std::erase_if(findings, [](const std::string& line) { return line.find("cup") != std::string::npos; });
  EXPECT_TRUE(findings.empty()) << testing::PrintToString(findings);
}

TEST_F(OnItsFloor, WhatItRunsIntoCountsOnce) {
  drive(-4, -4, 4);  // into the west wall, 0.75 m behind it
  EXPECT_EQ(truth().collisions, 1);
  EXPECT_EQ(truth().touched, "wall_west");
}

TEST_F(OnItsFloor, TheSameSeedGivesTheSameBytes) {
  drive(2, 3, 2);
  const std::uint64_t first = simulation_->state_digest();
  simulation_ = BaseSimulation::create(world_, 1).value();
  now_ = Time{};
  drive(2, 3, 2);
  EXPECT_EQ(simulation_->state_digest(), first);
  ASSERT_TRUE(simulation_->health());
}

}  // namespace
}  // namespace pons::sim
