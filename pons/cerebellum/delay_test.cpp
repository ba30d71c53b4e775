// Drives that act some milliseconds after they were told: the loop foresees it, and nothing else notices.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"
#include "pons/motion/motion.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::SafetyState;
using link::StopCause;
using link::StopResult;

AxisVector somewhere(Random& random) {
  AxisVector q = bench_robot().home;
  for (auto& angle : q) angle += random.uniform(-1.2, 1.2);
  return q;
}

// Of a run of moves at full limits.
struct Followed {
  double worst_rad = 0;  // from where the motion has the arm at that moment
  double contact = 0;    // share of what passes for no collision
  StopCause cause = StopCause::kNone;
};

Followed follow_moves(const PlantSettings& plant, const Settings& settings = {}) {
  Bench bench(plant, settings);
  bench.arm();
  Random random(5);
  Followed followed;
  for (int i = 0; i < 10 && bench.operational(); ++i) {
    const AxisState rest = at_rest(bench.state().commanded.position);
    const std::vector<Segment> motion = point_to_point(rest, bench.now + 20ms, somewhere(random), bench_robot().limits);
    bench.move(motion);
    for (int tick = 0; tick < 1700 && bench.operational(); ++tick) {
      bench.tick();
      const double age_s = to_s(bench.now - bench.plant.sensors.stamp);
      const AxisVector position = bench.plant.sensors.position + age_s * bench.plant.sensors.speed;
      const AxisVector wanted = motion::sample(motion, bench.now, 6).position;
      followed.worst_rad = std::max(followed.worst_rad, (wanted - position).cwiseAbs().maxCoeff());
    }
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
  }
  followed.contact = bench.cerebellum.statistics().contact;
  followed.cause = bench.state().cause;
  return followed;
}

Settings without_collisions() {
  Settings settings;
  settings.collision.torque_share = 1e9;
  return settings;
}

TEST(DriveDelay, IsForeseen) {
  const Followed none = follow_moves({.step = 1ms});
  std::printf("no delay: %.3f mrad, %.0f %% of a collision\n", 1e3 * none.worst_rad, 100 * none.contact);
  for (const Duration delay : {4ms, 7ms, 10ms}) {
    const Followed unknown = follow_moves({.step = 1ms, .drive_delay = delay}, without_collisions());
    std::printf("%.0f ms that nobody told of: %.3f mrad\n", 1e3 * to_s(delay), 1e3 * unknown.worst_rad);
    const Followed told = follow_moves({.step = 1ms, .drive_delay = delay, .told_delay = delay});
    std::printf("%.0f ms, told: %.3f mrad, %.0f %% of a collision\n", 1e3 * to_s(delay), 1e3 * told.worst_rad,
                100 * told.contact);
    EXPECT_EQ(told.cause, StopCause::kNone) << name(told.cause);
    EXPECT_LT(told.worst_rad, 2 * none.worst_rad);
    EXPECT_LT(told.worst_rad - none.worst_rad, (unknown.worst_rad - none.worst_rad) / 4);
    EXPECT_LT(told.contact, 2 * none.contact);
  }
}

// Nor does a model that is a little wrong make it swing.
TEST(DriveDelay, StaysWithinAMilliradianWithOtherMasses) {
  for (const double masses : {0.95, 1.05}) {
    for (const Duration delay : {4ms, 10ms}) {
      const Followed told = follow_moves({.step = 2ms, .masses = masses, .drive_delay = delay, .told_delay = delay});
      std::printf("masses times %.2f, %.0f ms: %.3f mrad\n", masses, 1e3 * to_s(delay), 1e3 * told.worst_rad);
      EXPECT_EQ(told.cause, StopCause::kNone) << name(told.cause);
      EXPECT_LT(told.worst_rad, 1e-3);
    }
  }
}

// Told too much or too little, it follows less well, and still does not swing.
TEST(DriveDelay, MayBeTwoMillisecondsOff) {
  for (const Duration told_delay : {2ms, 6ms}) {
    const Followed told =
        follow_moves({.step = 1ms, .drive_delay = 4ms, .told_delay = told_delay}, without_collisions());
    std::printf("4 ms, told of %.0f ms: %.3f mrad\n", 1e3 * to_s(told_delay), 1e3 * told.worst_rad);
    EXPECT_EQ(told.cause, StopCause::kNone) << name(told.cause);
    EXPECT_LT(told.worst_rad, 1e-3);
  }
}

// From full motion, by every way to stop; then it may be armed again and moves.
TEST(DriveDelay, StopsAreConfirmed) {
  for (const CommandKind kind : {CommandKind::kProtectiveStop, CommandKind::kHeartbeat}) {
    const bool emergency = kind == CommandKind::kHeartbeat;
    Bench bench({.drive_delay = 4ms, .told_delay = 4ms});
    bench.arm();
    const AxisVector there = bench_robot().home.array() + 0.8;
    bench.move(there);
    bench.run(300ms);
    if (emergency)
      bench.link->raise_emergency_stop();
    else
      bench.send(plain_command(kind));
    bench.tick();
    EXPECT_EQ(bench.state().safety, emergency ? SafetyState::kEmergencyStopping : SafetyState::kStopping);
    bench.run(800ms);
    EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
    EXPECT_EQ(bench.state().safety, emergency ? SafetyState::kEmergencyStop : SafetyState::kProtectiveStop);
    EXPECT_EQ(bench.plant.set_points.power, !emergency);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0u);
    bench.link->clear_emergency_stop();
    bench.run(20ms);
    bench.send(plain_command(CommandKind::kReset));
    bench.run(20ms);
    bench.arm();
    bench.move(there);
    bench.run(1500ms);
    EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
    EXPECT_LT((bench.plant.sensors.position - there).cwiseAbs().maxCoeff(), 1e-4);
  }
}

// A wall is found, and what follows gives way and holds.
TEST(DriveDelay, CollisionsAreFelt) {
  Bench bench({.drive_delay = 4ms, .told_delay = 4ms});
  bench.arm();
  bench.move(AxisVector(bench_robot().home.array() + 0.8));
  bench.run(300ms);
  bench.plant.blocked = true;
  bench.run(20ms);
  EXPECT_EQ(bench.state().cause, StopCause::kCollision);
  bench.plant.blocked = false;
  bench.run(1500ms);
  EXPECT_EQ(bench.state().stop_result, StopResult::kConfirmed);
}

// A spring at late drives has weak dampers: pushed and let go it swings, and comes to rest in seconds.
TEST(DriveDelay, ACompliantArmComesToRest) {
  Bench bench({.step = 1ms, .drive_delay = 4ms, .told_delay = 4ms});
  bench.arm();
  link::Command contact = plain_command(CommandKind::kContact);
  contact.contact_n = 100;
  bench.send(contact);
  link::Command control = plain_command(CommandKind::kControl);
  control.controller = link::Controller::kImpedance;
  control.compliance.stiffness = {1000, 1000, 1000, 60, 60, 60};
  control.compliance.damping = {140, 140, 140, 8, 8, 8};
  control.compliance.force_max_n = 150;
  bench.send(control);
  bench.run(200ms);
  auto model = bench_model();
  Vector6 push = Vector6::Zero();
  push[2] = 10;
  bench.plant.extra_torque_nm = model.tip_jacobian(bench.plant.sensors.position).transpose() * push;
  const double before = model.world_from_tip(bench.plant.sensors.position).translation().z();
  bench.run(3000ms);
  EXPECT_NEAR(model.world_from_tip(bench.plant.sensors.position).translation().z() - before, 0.010, 0.0005);
  EXPECT_LT(bench.plant.sensors.speed.cwiseAbs().maxCoeff(), 1e-2);
  bench.plant.extra_torque_nm.setZero();
  bench.run(4000ms);
  EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
  EXPECT_LT(bench.plant.sensors.speed.cwiseAbs().maxCoeff(), 1e-2);
}

// Later than that a spring at the drives would swing.
TEST(DriveDelay, NoImpedanceWithDrivesThatAreTooLate) {
  Bench bench({.step = 1ms, .drive_delay = 6ms, .told_delay = 6ms});
  bench.arm();
  link::Command control = plain_command(CommandKind::kControl);
  control.controller = link::Controller::kImpedance;
  control.compliance.stiffness.fill(60);
  control.compliance.damping.fill(8);
  control.compliance.force_max_n = 150;
  bench.send(control);
  bench.tick();
  EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
  EXPECT_EQ(bench.state().controller, link::Controller::kTracking);
}

}  // namespace
}  // namespace pons::cerebellum
