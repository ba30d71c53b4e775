// What pushes on the arm is measured and told from what moves it; a collision stops the arm before it presses hard.
#include "pons/cerebellum/collision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;

AxisVector away(double by) { return bench_robot().home.array() + by; }

link::Command contact_command(double force_n) {
  link::Command command = plain_command(CommandKind::kContact);
  command.contact_n = force_n;
  return command;
}

link::Command payload_command(double mass_kg) {
  link::Command command = plain_command(CommandKind::kPayload);
  command.payload_kg = mass_kg;
  command.payload_com_m = {0, 0, 0.2};
  return command;
}

Settings deaf() {
  Settings settings;
  settings.collision.torque_share = 1e9;
  return settings;
}

// A stiff plane across the tip's way.
struct Wall {
  Vector3 point, against;  // world frame; `against` is the unit vector into it
  double stiffness_n_m = 30'000;
  double force_n = 0, peak_n = 0;

  void push(Bench& bench, model::RobotModel& model) {
    const AxisVector& at = bench.plant.sensors.position;
    const double depth_m = (model.world_from_tip(at).translation() - point).dot(against);
    force_n = std::max(0.0, stiffness_n_m * depth_m);
    peak_n = std::max(peak_n, force_n);
    bench.plant.extra_torque_nm = model.tip_jacobian(at).topRows<3>().transpose() * Vector3(-force_n * against);
  }
};

// Every axis, at this share of the speed limits.
void set_out(Bench& bench, double speed_share) {
  AxisLimits limits = bench_robot().limits;
  limits.speed_rad_s *= speed_share;
  const AxisState rest{bench.state().commanded.position, AxisVector::Zero(6), AxisVector::Zero(6)};
  bench.move(point_to_point(rest, bench.now + 20ms, away(0.8), limits));
}

// Across where the tip of such a move is after `after`.
Wall wall_across(double speed_share, Duration after) {
  Bench free({.step = 1ms}, deaf());
  free.arm();
  set_out(free, speed_share);
  free.run(after);
  auto model = bench_model();
  const AxisVector& at = free.plant.sensors.position;
  const Vector3 speed = model.tip_jacobian(at).topRows<3>() * free.plant.sensors.speed;
  return {model.world_from_tip(at).translation(), speed.normalized()};
}

struct Hit {
  StopCause cause = StopCause::kNone;
  double to_stop_ms = 0, peak_n = 0, rests_n = 0;
};

Hit hit_wall(const Settings& settings, double speed_share, Duration after) {
  Wall wall = wall_across(speed_share, after);
  auto model = bench_model();
  Bench bench({.step = 1ms}, settings);
  bench.arm();
  set_out(bench, speed_share);
  Hit hit;
  Time touched, stopped;
  for (int tick = 0; tick < 3000; ++tick) {
    bench.tick();
    wall.push(bench, model);
    if (wall.force_n > 0 && touched == Time{}) touched = bench.now;
    if (!bench.operational() && stopped == Time{}) stopped = bench.now, hit.cause = bench.state().cause;
  }
  EXPECT_GT(touched, Time{});
  // One that bounces for longer than confirm_within loses its power.
  const SafetyState safety = bench.state().safety;
  EXPECT_TRUE(safety == SafetyState::kProtectiveStop || safety == SafetyState::kEmergencyStop) << name(safety);
  hit.to_stop_ms = 1e3 * to_s(stopped - touched);
  hit.peak_n = wall.peak_n;
  hit.rests_n = wall.force_n;
  return hit;
}

TEST(Collision, StopsSoonerAndSofterThanFollowingError) {
  for (const auto& [share, after] : {std::pair<double, Duration>{0.1, 600ms}, {0.2, 400ms}, {0.3, 500ms}}) {
    const Hit felt = hit_wall({}, share, after), followed = hit_wall(deaf(), share, after);
    std::printf(
        "%2.0f %% of the speed limits: collision %.0f ms, peak %.0f N, rests with %.1f N; following error %.0f ms, "
        "%.0f N\n",
        100 * share, felt.to_stop_ms, felt.peak_n, felt.rests_n, followed.to_stop_ms, followed.peak_n);
    EXPECT_EQ(felt.cause, StopCause::kCollision);
    EXPECT_EQ(followed.cause, StopCause::kFollowingError);
    EXPECT_LE(felt.to_stop_ms, 20);
    EXPECT_LT(felt.to_stop_ms, 0.5 * followed.to_stop_ms);
    EXPECT_LT(felt.peak_n, (share < 0.15 ? 0.7 : 1.0) * followed.peak_n);
    EXPECT_LT(felt.rests_n, 30);
  }
}

// What it can do for the blow of a fast arm is to be there sooner; the energy is the arm's own.
TEST(Collision, IsNoticedInMillisecondsAtFullSpeed) {
  for (const Duration after : {200ms, 300ms, 400ms}) {
    const Hit felt = hit_wall({}, 1, after), followed = hit_wall(deaf(), 1, after);
    std::printf("full speed: collision %.0f ms, peak %.0f N; following error %.0f ms, %.0f N\n", felt.to_stop_ms,
                felt.peak_n, followed.to_stop_ms, followed.peak_n);
    EXPECT_EQ(felt.cause, StopCause::kCollision);
    EXPECT_LE(felt.to_stop_ms, 6);
    EXPECT_GT(followed.to_stop_ms, 20);
  }
}

// A heap of parcels: gives way slowly under whoever presses it, and stays where it was pressed to.
struct Heap {
  Wall wall;
  double grip_ns_m = 2000;
  double gave_way_m = 0;

  void push(Bench& bench, model::RobotModel& model) {
    wall.push(bench, model);
    const double way_m = wall.force_n / grip_ns_m * 1e-3;  // in a tick
    wall.point += way_m * wall.against;
    gave_way_m += way_m;
  }
};

// An arm that goes on pressing it creeps with it for longer than that.
Settings impatient() {
  Settings settings = deaf();
  settings.confirm_within = 500ms;
  return settings;
}

// Whoever held the commanded place would press on, and the heap would creep on: no standstill, and a person to call.
TEST(FollowingError, InWhatGivesWaySlowlyIsAProtectiveStopThatStands) {
  Heap heap{wall_across(0.2, 400ms)};
  auto model = bench_model();
  Bench bench({.step = 1ms}, impatient());
  bench.arm();
  set_out(bench, 0.2);
  for (int tick = 0; tick < 5000; ++tick) {
    const bool followed = bench.operational();
    bench.tick();
    heap.push(bench, model);
    if (followed && !bench.operational()) {
      EXPECT_LT(bench.error_rad(), 0.02) << "it brakes from where it is";
    }
  }
  EXPECT_GT(heap.gave_way_m, 0.001);
  EXPECT_EQ(bench.state().cause, StopCause::kFollowingError);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  EXPECT_LT(heap.wall.force_n, 10);
}

TEST(Collision, IsLeftLikeAnyProtectiveStop) {
  Bench bench;
  bench.arm();
  bench.move(away(0.5));
  bench.run(200ms);
  bench.plant.extra_torque_nm[1] = 90;
  bench.run(20ms);
  bench.plant.extra_torque_nm.setZero();
  EXPECT_EQ(bench.state().cause, StopCause::kCollision);
  bool told = false;
  bench.cerebellum.log().drain(
      [&](Time, std::string_view text) { told |= text.starts_with("axis 2 is pushed with "); });
  EXPECT_TRUE(told);
  bench.run(1s);
  EXPECT_EQ(bench.state().safety, SafetyState::kProtectiveStop);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  EXPECT_LT(bench.error_rad(), 1e-3);
  bench.send(plain_command(CommandKind::kReset));
  bench.run(50ms);
  bench.send(plain_command(CommandKind::kArm));
  bench.run(50ms);
  EXPECT_TRUE(bench.operational());
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
}

struct CalmCase {
  PlantSettings plant;
  double told_kg;
};

class Calm : public testing::TestWithParam<CalmCase> {};

// Fast moves with a wrong model, a load, and a load that the arm believes to hold and has lost.
TEST_P(Calm, NothingThatMovesTheArmItselfIsACollision) {
  Bench bench(GetParam().plant);
  bench.send(payload_command(GetParam().told_kg));
  bench.arm();
  Random random(9);
  for (int i = 0; i < 6; ++i) {
    AxisVector to = bench_robot().home;
    for (auto& angle : to) angle += random.uniform(-1.0, 1.0);
    bench.move(to);
    bench.run(1500ms);
    ASSERT_TRUE(bench.operational()) << name(bench.state().cause);
  }
  const double most = bench.cerebellum.statistics().contact;
  std::printf("share of what passes for no collision: %.2f\n", most);
  EXPECT_LT(most, 1);
  EXPECT_GT(most, 0);
}

const model::Payload kLoad{.mass_kg = 1.5, .com_m = {0, 0, 0.2}};
INSTANTIATE_TEST_SUITE_P(Plants, Calm,
                         testing::Values(CalmCase{{.step = 2ms}, 0}, CalmCase{{.step = 1ms, .masses = 1.05}, 0},
                                         CalmCase{{.step = 2ms, .masses = 0.95}, 0},
                                         CalmCase{{.step = 2ms, .payload = kLoad}, 1.5}, CalmCase{{.step = 2ms}, 1.5}));

TEST(Collision, AContactThatIsExpectedIsNone) {
  auto model = bench_model();
  for (const bool expected : {false, true}) {
    Bench bench;
    bench.arm();
    if (expected) bench.send(contact_command(200));
    bench.run(20ms);
    const model::Jacobian jacobian = model.tip_jacobian(bench.plant.sensors.position);
    for (int tick = 0; tick < 300; ++tick) {
      const double up_n = std::min(150.0, 1.0 * tick);  // as cups press, not as a blow
      bench.plant.extra_torque_nm = jacobian.topRows<3>().transpose() * Vector3(0, 0, up_n);
      bench.tick();
    }
    EXPECT_EQ(bench.operational(), expected);
    if (expected) {
      EXPECT_NEAR(bench.state().tip_wrench[2], 150, 8);
    } else {
      EXPECT_EQ(bench.state().cause, StopCause::kCollision);
    }
  }
}

TEST(Collision, ArmingForgetsAnExpectedContact) {
  Bench bench;
  bench.arm();
  bench.send(contact_command(400));
  bench.send(plain_command(CommandKind::kProtectiveStop));
  bench.run(1s);
  bench.send(plain_command(CommandKind::kReset));
  bench.run(50ms);
  bench.send(plain_command(CommandKind::kArm));
  bench.run(50ms);
  ASSERT_TRUE(bench.operational());
  bench.plant.extra_torque_nm[1] = 90;
  bench.run(30ms);
  EXPECT_EQ(bench.state().cause, StopCause::kCollision);
}

TEST(Collision, NoSkillMayExpectAnything) {
  for (const double force_n : {-1.0, 401.0, std::numeric_limits<double>::quiet_NaN()}) {
    Bench bench;
    bench.arm();
    bench.send(contact_command(force_n));
    bench.run(2ms);
    EXPECT_EQ(bench.state().cause, StopCause::kBadCommand) << force_n;
  }
}

// The plant's own true push, in motion: 63 % after one time constant, all of it after five, nothing without one.
TEST(Observer, FollowsAPushInMotionAndKnowsWhenThereIsNone) {
  Bench bench({.step = 1ms}, deaf());
  bench.arm();
  bench.move(away(0.6));
  bench.run(150ms);
  EXPECT_LT(bench.state().external_nm.cwiseAbs().maxCoeff(), 1.5);
  bench.plant.extra_torque_nm[2] = 20;
  bench.run(6ms);
  EXPECT_NEAR(bench.state().external_nm[2], 20 * 0.63, 4);
  bench.run(24ms);
  EXPECT_NEAR(bench.state().external_nm[2], 20, 1.5);
  EXPECT_LT(std::abs(bench.state().external_nm[1]), 1.5);
}

// What has no drift has none after a minute either.
TEST(Observer, DoesNotDrift) {
  Bench bench({.step = 2ms}, deaf());
  bench.arm();
  for (int i = 0; i < 20; ++i) {
    bench.move(away(i % 2 == 0 ? 0.7 : -0.2));
    bench.run(3s);
  }
  EXPECT_LT(bench.state().external_nm.cwiseAbs().maxCoeff(), 0.05);
}

TEST(Observer, ATipWrenchIsFoundFromItsTorques) {
  auto model = bench_model();
  Random random(10);
  int told = 0;
  for (int i = 0; i < 200; ++i) {
    AxisVector q = bench_robot().home;
    for (auto& angle : q) angle += random.uniform(-0.5, 0.5);
    const model::Jacobian jacobian = model.tip_jacobian(q);
    const Eigen::Matrix<double, 6, 6> square = jacobian * jacobian.transpose();
    if (std::abs(square.determinant()) < 1e-4) continue;
    Vector6 wrench;
    for (auto& value : wrench) value = random.uniform(-30, 30);
    wrench.tail<3>() *= 0.1;
    const Vector6 found = tip_wrench(jacobian, jacobian.transpose() * wrench);
    EXPECT_LT((found - wrench).norm(), 0.15 * wrench.norm());
    ++told;
  }
  EXPECT_GT(told, 100);
}

}  // namespace
}  // namespace pons::cerebellum
