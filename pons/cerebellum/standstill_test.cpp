// When an arm that was stopped stands, and that it stays there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/gravity.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

// In ticks: braking, and then whatever may be waited for standstill.
constexpr int kLongestStop = 200 + static_cast<int>(Settings{}.confirm_within / 1ms);

TEST(StopResultTest, IsUncertainWhenTheArmWillNotStandStill) {
  Bench bench;
  get_moving(bench);
  bench.link->raise_emergency_stop();
  // Somebody shakes it.
  for (int i = 0; i < kLongestStop; ++i) {
    bench.plant.extra_torque_nm[5] = (i / 10) % 2 == 0 ? 25 : -25;
    bench.tick();
    if (bench.state().safety == SafetyState::kEmergencyStop) break;
  }
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().stop_result, StopResult::kUncertain);
  EXPECT_FALSE(bench.plant.set_points.power);  // category 0 when standstill is not confirmed in time
  bench.run(100ms);                            // the brakes do
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
}

TEST(StopResultTest, AProtectiveStopWithoutStandstillFallsBackToCategoryZero) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  for (int i = 0; i < kLongestStop && bench.plant.set_points.power; ++i) {
    bench.plant.extra_torque_nm[5] = (i / 10) % 2 == 0 ? 25 : -25;
    bench.tick();
  }
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().cause, StopCause::kNoStandstill);
  EXPECT_EQ(bench.state().stop_result, StopResult::kUncertain);
  EXPECT_FALSE(bench.plant.set_points.power);
  EXPECT_EQ(bench.state().epoch, 2u);
  bench.run(100ms);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
}

TEST(StopResultTest, AnArmThatIsPushedOutOfAProtectiveStopLosesItsPower) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.run(1s);
  ASSERT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  bench.plant.extra_torque_nm[5] = 60;  // twice what its motor has
  bench.run(500ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kEmergencyStop);
  EXPECT_EQ(bench.state().cause, StopCause::kNoStandstill);
  EXPECT_FALSE(bench.plant.set_points.power);
}

// As by what it came down on: the drives push against that as long as they are told to be elsewhere.
TEST(StopResultTest, AnArmThatIsHeldOffAsItBrakesStandsWhereItIs) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.tick();
  const double from = bench.plant.sensors.position[5];
  for (int i = 0; i < kLongestStop; ++i) {
    const double held_at = from - std::min(0.15, 1e-3 * i);
    bench.plant.extra_torque_nm[5] = 500 * (held_at - bench.plant.sensors.position[5]);
    bench.tick();
  }
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop) << name(bench.state().cause);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
  EXPECT_LT(std::abs(bench.state().commanded.position[5] - bench.plant.sensors.position[5]),
            Settings{}.following_error_rad);
  bench.plant.extra_torque_nm[5] = 0;
  bench.run(500ms);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
}

// As a parcel that leans on it: the arm moves on until its drives bear that, and there they go on bearing it.
TEST(StopResultTest, AnArmThatIsPushedAsItBrakesBearsItWhereItStands) {
  Bench bench;
  get_moving(bench);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.plant.extra_torque_nm[4] = 12;
  double off_rad = 0;
  for (; bench.state().safety != SafetyState::kProtectiveStop && bench.plant.set_points.power; bench.tick())
    off_rad = bench.error_rad();
  ASSERT_EQ(bench.state().stop_result, StopResult::kConfirmed);
  EXPECT_EQ(bench.state().cause, StopCause::kCommanded);
  EXPECT_GT(off_rad, 1.1 * Settings{}.following_error_rad);
  EXPECT_LT(bench.error_rad(), 0.001) << "it is held where it stands";
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop) << name(bench.state().cause);
  bench.plant.extra_torque_nm[4] = 0;
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop) << "it springs back: " << name(bench.state().cause);
}

// On its bellows, which hardly damp it.
struct SprungLoad {
  static constexpr double kMass_kg = 8, kSwings_rad_s = 19, kDamping = 0.02;
  Vector3 at, speed_m_s = Vector3::Zero();

  void pull(Bench& bench, model::RobotModel& model) {
    constexpr double kTick_s = 1e-3, kStiffness_n_m = kMass_kg * kSwings_rad_s * kSwings_rad_s;
    const AxisVector& q = bench.plant.sensors.position;
    const Eigen::Matrix3Xd jacobian = model.tip_jacobian(q).topRows<3>();
    const Vector3 stretch_m = model.world_from_tip(q).translation() - at;
    const Vector3 rate_m_s = jacobian * bench.plant.sensors.speed - speed_m_s;
    const Vector3 force_n = kStiffness_n_m * stretch_m + 2 * kDamping * kMass_kg * kSwings_rad_s * rate_m_s;
    speed_m_s += kTick_s * (force_n / kMass_kg - Vector3(0, 0, kGravity_m_s2));
    at += kTick_s * speed_m_s;
    bench.plant.extra_torque_nm = jacobian.transpose() * -force_n;
  }
};

// Nobody told of its weight. An integral as fast as a motion's would keep it swinging, and the arm with it.
TEST(StopResultTest, StandsThoughWhatItCarriesSwings) {
  Settings settings;
  settings.collision.torque_share = 1e9;
  settings.following_error_rad = 1;
  auto model = bench_model();
  Bench bench({.step = 1ms}, settings);
  bench.arm();
  SprungLoad load{model.world_from_tip(bench.plant.sensors.position).translation()};
  load.at.z() -= kGravity_m_s2 / (SprungLoad::kSwings_rad_s * SprungLoad::kSwings_rad_s);
  load.speed_m_s = {0.05, 0, 0};
  bench.send(plain_command(CommandKind::kProtectiveStop));
  for (int tick = 0; tick < 3000; ++tick) {
    load.pull(bench, model);
    bench.tick();
  }
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
}

}  // namespace
}  // namespace pons::cerebellum
