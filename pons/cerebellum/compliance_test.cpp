// Closed loops of the compliant laws with the arm's dynamics: springs give way as they were told to, forces are held.
#include "pons/cerebellum/compliance.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/cerebellum/wrist.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;
using link::CommandKind;
using link::Controller;
using link::StopCause;

link::Compliance springs(double n_m, double nm_rad) {
  link::Compliance compliance;
  compliance.stiffness = {n_m, n_m, n_m, nm_rad, nm_rad, nm_rad};
  compliance.damping = {2 * std::sqrt(5 * n_m), 2 * std::sqrt(5 * n_m), 2 * std::sqrt(5 * n_m), 8, 8, 8};
  compliance.force_max_n = 150;
  return compliance;
}

link::Command control_command(Controller controller, const link::Compliance& compliance = {}) {
  link::Command command = plain_command(CommandKind::kControl);
  command.controller = controller;
  command.compliance = compliance;
  return command;
}

void expect_contact(Bench& bench, double force_n) {
  link::Command command = plain_command(CommandKind::kContact);
  command.contact_n = force_n;
  bench.send(command);
}

// A push on the tip in its own axes, felt by joints and wrist.
class Hand {
 public:
  explicit Hand(Bench& bench) : bench_(bench) {}
  void push(const Vector6& wrench) {
    const AxisVector& at = bench_.plant.sensors.position;
    const Eigen::Matrix3d world_from_tip = model_.world_from_tip(at).linear();
    Vector6 world;
    world << world_from_tip * wrench.head<3>(), world_from_tip * wrench.tail<3>();
    bench_.plant.extra_torque_nm = model_.tip_jacobian(at).transpose() * world;
    const AxisState motion{at, bench_.plant.sensors.speed, bench_.state().commanded.acceleration};
    const Vector6 carried = carried_wrench(model_, motion, {});
    const Vector3 lever = bench_robot().tool.flange_from_tip.translation();
    const Vector3 moment = wrench.tail<3>() + lever.cross(Vector3(wrench.head<3>()));
    for (Eigen::Index i = 0; i < 3; ++i) {
      const auto index = static_cast<std::size_t>(i);
      bench_.plant.sensors.wrist_force_n[index] = carried[i] + wrench[i];
      bench_.plant.sensors.wrist_torque_nm[index] = carried[i + 3] + moment[i];
    }
  }
  void hold(const Vector6& wrench, int ticks) {
    for (int tick = 0; tick < ticks; ++tick) {
      push(wrench);
      bench_.tick();
    }
  }
  [[nodiscard]] Pose tip() { return model_.world_from_tip(bench_.plant.sensors.position); }

 private:
  Bench& bench_;
  model::RobotModel model_ = bench_model();
};

Vector6 along(int axis, double value) {
  Vector6 wrench = Vector6::Zero();
  wrench[axis] = value;
  return wrench;
}

// How far the tip gives way along its axis to a steady force, which must be one that the bounded integral of computed
// torque can hold on the light axes of the wrist: about 12 N across the tool here.
double yields(Controller controller, double stiffness, int axis, double force) {
  Bench bench({.step = 1ms});
  bench.arm();
  expect_contact(bench, 100);
  Hand hand(bench);
  hand.hold(Vector6::Zero(), 20);
  bench.send(control_command(controller, springs(stiffness, 60)));
  hand.hold(Vector6::Zero(), 200);
  EXPECT_EQ(bench.state().controller, controller);
  const Pose before = hand.tip();
  hand.hold(along(axis, force), 3000);
  EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
  const Pose after = before.inverse() * hand.tip();
  const Eigen::AngleAxisd turned(Eigen::Matrix3d(after.linear()));
  return axis < 3 ? after.translation()[axis] : turned.angle() * turned.axis()[axis - 3];
}

TEST(Compliance, AnArmIsTheSpringThatWasAskedFor) {
  for (const Controller controller : {Controller::kImpedance, Controller::kAdmittance}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double stiffness = 10 / yields(controller, 1000, axis, 10);
      std::printf("%s, axis %d: %.1f N/m of 1000 N/m\n", std::string(name(controller)).c_str(), axis, stiffness);
      EXPECT_NEAR(stiffness, 1000, 30);
    }
    const double turns = 2 / yields(controller, 1000, 4, 2);
    std::printf("%s, about axis 4: %.2f N·m/rad of 60\n", std::string(name(controller)).c_str(), turns);
    EXPECT_NEAR(turns, 60, 2);
  }
}

world::Robot seven_axes() {
  world::Robot robot;
  robot.name = "panda7";
  robot.urdf = "worlds/robots/panda7/panda7.urdf";
  robot.flange_link = "flange";
  robot.home = AxisVector(7);
  robot.home << 0.0, -0.2067, 0.0, -2.3596, 0.0, 2.1529, 0.0;
  robot.limits.position_min = AxisVector::Constant(7, -3);
  robot.limits.position_max = AxisVector::Constant(7, 3.8);
  for (AxisVector* limit : {&robot.limits.speed_rad_s, &robot.limits.acceleration_rad_s2, &robot.limits.jerk_rad_s3,
                            &robot.limits.torque_nm})
    *limit = AxisVector::Constant(7, 10);
  robot.rotor_inertia_kg_m2 = AxisVector::Constant(7, 0.01);
  robot.tool.mass_kg = 0.9;
  robot.tool.flange_from_tip.translation() = Vector3(0, 0, 0.16);
  return robot;
}

// The elbow is pushed aside and comes back; the tip, free to yield as a spring, does not notice.
TEST(Compliance, TheSeventhAxisFollowsItsPostureWithoutMovingTheTip) {
  const world::Robot robot = seven_axes();
  auto model = model::RobotModel::load(robot).value();
  const AxisVector zero = AxisVector::Zero(7);
  AxisVector position = robot.home, speed = zero, torque, acceleration;
  const Pose wanted = model.world_from_tip(robot.home);
  for (int step = 0; step < 300; ++step) {  // along the motion that leaves the tip where it is
    const model::Jacobian jacobian = model.tip_jacobian(position);
    const Eigen::MatrixXd kernel = Eigen::MatrixXd(jacobian).fullPivLu().kernel();
    const AxisVector along = kernel.col(0).normalized() * (kernel(2, 0) > 0 ? 1e-3 : -1e-3);
    position += along;
  }
  const double aside = (position - robot.home).norm();
  ASSERT_GT(aside, 0.2);
  const model::Payload empty;
  double off_m = 0;
  const double began_m = (model.world_from_tip(position).translation() - wanted.translation()).norm();
  for (int tick = 0; tick < 1500; ++tick) {
    impedance(model, springs(1000, 60), {}, {position, speed, empty}, {robot.home, zero, zero}, torque);
    model.forward_dynamics(position, speed, torque, {}, acceleration);
    speed += 1e-3 * acceleration;
    position += 1e-3 * speed;
    off_m = std::max(off_m, (model.world_from_tip(position).translation() - wanted.translation()).norm());
  }
  std::printf("elbow aside by %.2f rad: back within %.4f rad; the tip began %.2f mm off and was %.2f mm at most\n",
              aside, (position - robot.home).norm(), 1e3 * began_m, 1e3 * off_m);
  EXPECT_LT((position - robot.home).norm(), 0.02 * aside);
  EXPECT_LT(off_m, 0.003);
}

// Against a wall along the tip's axis, from free space: the wrist holds what was asked for.
TEST(Compliance, AdmittanceComesDownUntilItPressesAsAskedAndKeepsPressing) {
  Bench bench({.step = 1ms});
  bench.arm();
  Hand hand(bench);
  expect_contact(bench, 100);
  hand.hold(Vector6::Zero(), 20);
  link::Compliance press = springs(2000, 100);
  press.stiffness[2] = 0;
  press.damping[2] = 600;
  press.wrench[2] = 25;
  bench.send(control_command(Controller::kAdmittance, press));
  const Pose start = hand.tip();
  double force_n = 0, least_n = 1e9, most_n = 0;
  for (int tick = 0; tick < 2500; ++tick) {
    const double depth_m = (start.inverse() * hand.tip()).translation().z() - 0.01;
    force_n = std::max(0.0, 12'000 * depth_m);
    hand.push(along(2, -force_n));
    bench.tick();
    if (tick > 1500) least_n = std::min(least_n, force_n), most_n = std::max(most_n, force_n);
  }
  std::printf("25 N asked for: %.2f to %.2f N\n", least_n, most_n);
  EXPECT_NEAR(least_n, 25, 0.5);
  EXPECT_NEAR(most_n, 25, 0.5);
  EXPECT_TRUE(bench.operational());
}

// A stop while it presses: it stays where it is instead of pressing on.
TEST(Compliance, AStopEndsThePush) {
  Bench bench({.step = 1ms});
  bench.arm();
  Hand hand(bench);
  hand.hold(Vector6::Zero(), 20);
  link::Compliance press = springs(2000, 100);
  press.stiffness[2] = 0;
  press.damping[2] = 600;
  press.wrench[2] = 20;
  bench.send(control_command(Controller::kAdmittance, press));
  hand.hold(Vector6::Zero(), 300);
  bench.send(plain_command(CommandKind::kProtectiveStop));
  hand.hold(Vector6::Zero(), 100);
  const Pose stopped = hand.tip();
  hand.hold(Vector6::Zero(), 1000);
  EXPECT_LT((stopped.inverse() * hand.tip()).translation().norm(), 1e-4);
  EXPECT_EQ(bench.state().safety, link::SafetyState::kProtectiveStop);
}

// An arm without stiffness that is thrown: a stop does not rely on the damper that was asked for.
TEST(Compliance, AStopBrakesAnArmOnASoftSpring) {
  for (const bool thrown_too_fast : {false, true}) {
    Bench bench({.step = 1ms});
    bench.arm();
    expect_contact(bench, 200);
    Hand hand(bench);
    hand.hold(Vector6::Zero(), 20);
    link::Compliance soft = springs(0, 0);
    soft.damping = {0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
    soft.wrench[0] = 60;
    bench.send(control_command(Controller::kImpedance, soft));
    for (int tick = 0; tick < (thrown_too_fast ? 1000 : 25) && bench.operational(); ++tick)
      hand.hold(Vector6::Zero(), 1);
    const AxisVector& limit = bench_robot().limits.speed_rad_s;
    EXPECT_GT(bench.plant.sensors.speed.cwiseAbs().cwiseQuotient(limit).maxCoeff(), 0.2);
    if (!thrown_too_fast) bench.send(plain_command(CommandKind::kProtectiveStop));
    int ticks = 0;
    for (; ticks < 500 && bench.state().stop_result != link::StopResult::kConfirmed; ++ticks)
      hand.hold(Vector6::Zero(), 1);
    std::printf("at most %.2f of a speed limit, confirmed to stand after %d ms\n",
                bench.cerebellum.statistics().measured_speed, ticks);
    EXPECT_EQ(bench.state().cause, thrown_too_fast ? StopCause::kLimit : StopCause::kCommanded);
    EXPECT_EQ(bench.state().safety, link::SafetyState::kProtectiveStop);
    EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
    EXPECT_LT(bench.cerebellum.statistics().measured_speed, 1.7);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  }
}

// Likewise under admittance, which would go on by what it was pushed to, or swing back.
TEST(Compliance, AStopLeavesAdmittanceWhereItIs) {
  for (const double stiffness : {0.0, 500.0}) {
    Bench bench({.step = 1ms});
    bench.arm();
    Hand hand(bench);
    hand.hold(Vector6::Zero(), 20);
    link::Compliance weak = springs(stiffness, stiffness / 10);
    weak.damping = {0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
    bench.send(control_command(Controller::kAdmittance, weak));
    hand.hold(along(2, 10), 150);
    ASSERT_TRUE(bench.operational());
    const Pose before = hand.tip();
    bench.send(plain_command(CommandKind::kProtectiveStop));
    hand.hold(Vector6::Zero(), 200);
    EXPECT_EQ(bench.state().safety, link::SafetyState::kProtectiveStop);
    EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
    const Pose stopped = hand.tip();
    EXPECT_LT((before.inverse() * stopped).translation().norm(), 0.01);
    hand.hold(Vector6::Zero(), 1000);
    EXPECT_LT((stopped.inverse() * hand.tip()).translation().norm(), 3e-4);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  }
}

// Nor does the acceleration of a blow that has just begun carry it on.
TEST(Compliance, AStopAtTheBeginningOfAPushIsShort) {
  Bench bench({.step = 1ms});
  bench.arm();
  Hand hand(bench);
  expect_contact(bench, 200);
  hand.hold(Vector6::Zero(), 20);
  link::Compliance soft = springs(0, 0);
  soft.damping = {20, 20, 20, 1, 1, 1};
  bench.send(control_command(Controller::kAdmittance, soft));
  hand.hold(Vector6::Zero(), 20);
  hand.hold(along(2, 60), 3);
  ASSERT_TRUE(bench.operational());
  const AxisVector before = bench.state().commanded.position;
  bench.send(plain_command(CommandKind::kProtectiveStop));
  hand.hold(Vector6::Zero(), 300);
  EXPECT_EQ(bench.state().stop_result, link::StopResult::kConfirmed);
  const double way = (bench.state().commanded.position - before).cwiseAbs().maxCoeff();
  std::printf("%.2f mrad after a push of 3 ms\n", 1e3 * way);
  EXPECT_LT(way, 2e-3);
}

// An arm on a spring that is pushed along, axis 1 as fast as that; the joints feel nothing else.
class OnASpring {
 public:
  explicit OnASpring(const PlantSettings& plant, double begin_rad = bench_robot().home[0]) : bench(plant) {
    AxisVector place = bench_robot().home;
    place[0] = begin_rad;
    bench.plant.place(place);
    bench.run(50ms);
    bench.arm();
    expect_contact(bench, 200);
    bench.run(20ms);
    link::Compliance soft = springs(0, 0);
    soft.damping = {0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
    bench.send(control_command(Controller::kImpedance, soft));
    bench.run(20ms);
    bench.plant.extra_torque_nm = AxisVector::Zero(6);
    bench.plant.extra_torque_nm[0] = 15;
    while (bench.operational() && bench.plant.sensors.speed[0] < 2.5) bench.tick();
  }
  Bench bench;
};

// The stop begins where the arm is then, though drives act later, or the loop has slept: it is not drawn back or on.
TEST(Compliance, AStopOfAPushedArmDrawsItNowhere) {
  for (const Duration delay : {0ms, 4ms}) {
    for (const Duration gap : {0ms, 30ms}) {
      OnASpring arm({.step = 1ms, .drive_delay = delay, .told_delay = delay});
      ASSERT_TRUE(arm.bench.operational());
      if (gap > 0ms) {
        arm.bench.now += gap;
      } else {
        arm.bench.send(plain_command(CommandKind::kProtectiveStop));
      }
      arm.bench.plant.extra_torque_nm.setZero();
      double worst = 0;
      for (int tick = 0; tick < 300; ++tick) {
        arm.bench.tick();
        const AxisVector lead = to_s(delay) * arm.bench.state().commanded.speed;
        worst = std::max(
            worst,
            (arm.bench.state().commanded.position - lead - arm.bench.plant.sensors.position).cwiseAbs().maxCoeff());
      }
      std::printf("drives %.0f ms late, a gap of %.0f ms: %.2f mrad beside the stop\n", 1e3 * to_s(delay),
                  1e3 * to_s(gap), 1e3 * worst);
      EXPECT_EQ(arm.bench.state().cause, gap > 0ms ? StopCause::kLoopStalled : StopCause::kCommanded);
      EXPECT_EQ(arm.bench.state().stop_result, link::StopResult::kConfirmed);
      EXPECT_LT(worst, gap > 0ms ? 7e-4 : 4.7e-4);
    }
  }
}

TEST(Compliance, AnArmThatIsPushedOverItsLimitIsStoppedInTime) {
  const double limit = bench_robot().limits.position_max[0];
  OnASpring arm({.step = 1ms}, limit - 0.1);
  EXPECT_FALSE(arm.bench.operational());
  EXPECT_EQ(arm.bench.state().cause, StopCause::kLimit);
  arm.bench.plant.extra_torque_nm.setZero();
  arm.bench.run(500ms);
  EXPECT_EQ(arm.bench.state().stop_result, link::StopResult::kConfirmed);
  EXPECT_LT(arm.bench.plant.sensors.position[0], limit + 2e-3);
  EXPECT_EQ(arm.bench.cerebellum.statistics().violations, 0U);
}

// Somebody comes while the arm moves and gives way: slowed within the limits, not at once.
TEST(Compliance, WhoComesDuringMotionAndGivingWayBreaksNoLimit) {
  Settings settings;
  settings.zone_speed_share[0] = 0.3;
  Bench bench({.step = 1ms}, settings);
  bench.arm();
  Hand hand(bench);
  hand.hold(Vector6::Zero(), 20);
  link::Compliance soft = springs(0, 0);
  soft.damping = {20, 20, 20, 1, 1, 1};
  bench.send(control_command(Controller::kAdmittance, soft));
  hand.hold(Vector6::Zero(), 20);
  bench.move(AxisVector(bench_robot().home.array() + 1.5));
  hand.hold(along(0, 10), 350);
  ASSERT_GT(bench.state().commanded.speed.cwiseQuotient(bench_robot().limits.speed_rad_s).maxCoeff(), 0.6);
  bench.plant.sensors.zones_occupied = 1;
  hand.hold(along(0, 10), 600);
  const double share =
      bench.state().commanded.speed.cwiseAbs().cwiseQuotient(bench_robot().limits.speed_rad_s).maxCoeff();
  EXPECT_GT(share, 0.1) << "it should be on its way yet";
  EXPECT_LE(share, 0.3 * (1 - kGivingShare) * 1.01);
  EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
  EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
}

// Moved and pushed along at once, also where a zone allows less: motion and giving way together keep the limits.
TEST(Compliance, MotionAndGivingWayShareTheLimits) {
  for (const double share : {1.0, 0.3}) {
    Settings settings;
    settings.zone_speed_share[0] = share;
    Bench bench({.step = 1ms}, settings);
    bench.arm();
    expect_contact(bench, 200);
    Hand hand(bench);
    bench.plant.sensors.zones_occupied = 1;
    hand.hold(Vector6::Zero(), 20);
    link::Compliance soft = springs(0, 0);
    soft.damping = {20, 20, 20, 1, 1, 1};
    bench.send(control_command(Controller::kAdmittance, soft));
    hand.hold(Vector6::Zero(), 20);
    bench.move(AxisVector(bench_robot().home.array() + 1.5));
    const AxisVector& limit = bench_robot().limits.speed_rad_s;
    double fastest = 0, commanded = 0;
    for (int tick = 0; tick < 2500; ++tick) {
      const AxisVector before = bench.plant.sensors.position;
      hand.push(along(tick / 500 % 3, 12 * std::sin(2 * std::numbers::pi * tick / 500)));
      bench.tick();
      const AxisVector speed = (bench.plant.sensors.position - before) / 1e-3;
      if (tick < 250) continue;  // it is being slowed
      fastest = std::max(fastest, speed.cwiseAbs().cwiseQuotient(limit).maxCoeff());
      commanded = std::max(commanded, bench.state().commanded.speed.cwiseAbs().cwiseQuotient(limit).maxCoeff());
    }
    std::printf("of the speed limits, where %.1f is allowed: %.3f\n", share, fastest);
    EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
    EXPECT_LE(fastest, share * 1.15);  // the push itself moves the arm, too, before control has answered it
    EXPECT_LE(commanded, share * (1 - kGivingShare) * 1.01) << "so that it can give way at any time";
    EXPECT_GT(commanded, share * 0.6);
    EXPECT_EQ(bench.cerebellum.statistics().violations, 0U);
  }
}

// From any law to any other, pushed or not: no torque jumps by more than it changes between two ticks anyway.
TEST(Compliance, ChangingTheLawDoesNotJerk) {
  Random random(11);
  const AxisVector& limit = bench_robot().limits.torque_nm;
  double worst = 0;
  for (int i = 0; i < 12; ++i) {
    Bench bench({.step = 1ms, .masses = 1.05});
    bench.arm();
    Hand hand(bench);
    expect_contact(bench, 200);
    AxisVector to = bench_robot().home;
    for (auto& angle : to) angle += random.uniform(-0.4, 0.4);
    bench.move(to);
    hand.hold(Vector6::Zero(), 1500);
    const Vector6 push = along(static_cast<int>(random.below(3)), random.uniform(-25, 25));
    for (int change = 0; change < 4; ++change) {
      const auto law = static_cast<Controller>(random.below(3));
      hand.hold(push, 300);
      const AxisVector before = bench.state().torque_nm;
      bench.send(control_command(law, springs(random.uniform(300, 2000), 60)));
      hand.hold(push, 1);
      ASSERT_EQ(bench.state().controller, law);
      const double step = (bench.state().torque_nm - before).cwiseAbs().cwiseQuotient(limit).maxCoeff();
      worst = std::max(worst, step);
    }
    EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
  }
  std::printf("largest step of a torque at a change: %.2f %% of its limit\n", 100 * worst);
  EXPECT_LT(worst, 0.01);
}

TEST(Compliance, IsRefusedWhenItMakesNoSense) {
  const std::function<void(link::Command&)> faults[] = {
      [](link::Command& c) { c.compliance.stiffness[0] = -1; },
      [](link::Command& c) { c.compliance.stiffness[1] = 1e6; },
      [](link::Command& c) { c.compliance.damping[2] = 0; },
      [](link::Command& c) { c.compliance.damping[3] = std::numeric_limits<double>::quiet_NaN(); },
      [](link::Command& c) { c.compliance.wrench[2] = 1e3; },
      [](link::Command& c) { c.compliance.force_max_n = std::numeric_limits<double>::infinity(); },
      [](link::Command& c) { c.controller = static_cast<Controller>(7); },
  };
  for (const auto& spoil : faults) {
    Bench bench;
    bench.arm();
    link::Command command = control_command(Controller::kImpedance, springs(1000, 60));
    spoil(command);
    bench.send(command);
    bench.run(2ms);
    EXPECT_EQ(bench.state().cause, StopCause::kBadCommand);
    EXPECT_EQ(bench.state().controller, Controller::kTracking);
  }
}

TEST(Compliance, TheLawOfAMovingArmIsNotChanged) {
  Bench bench;
  bench.arm();
  bench.move(AxisVector(bench_robot().home.array() + 0.5));
  bench.run(200ms);
  const std::uint64_t dropped = bench.state().dropped;
  bench.send(control_command(Controller::kImpedance, springs(1000, 60)));
  bench.run(5ms);
  EXPECT_EQ(bench.state().dropped, dropped + 1);
  EXPECT_EQ(bench.state().controller, Controller::kTracking);
  EXPECT_TRUE(bench.operational());
  bench.send_old(control_command(Controller::kImpedance, springs(1000, 60)));
  bench.run(1500ms);
  EXPECT_EQ(bench.state().controller, Controller::kTracking);
}

}  // namespace
}  // namespace pons::cerebellum
