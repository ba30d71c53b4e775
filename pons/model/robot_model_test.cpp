#include "pons/model/robot_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <utility>

#include "pons/core/random.hpp"
#include "pons/model/test_robots.hpp"

namespace pons::model {
namespace {

AxisVector random_axes(Random& random, double span) {
  AxisVector q(6);
  for (auto& angle : q) angle = random.uniform(-span, span);
  return q;
}

// T = Rz(q) Tz(d) Tx(a) Rx(alpha), the published parameters.
Pose denavit_hartenberg(const AxisVector& q) {
  constexpr double kHalfPi = std::numbers::pi / 2;
  const double d[] = {0.1625, 0, 0, 0.1333, 0.0997, 0.0996}, a[] = {0, -0.425, -0.3922, 0, 0, 0},
               alpha[] = {kHalfPi, 0, 0, kHalfPi, -kHalfPi, 0};
  Pose pose = Pose::Identity();
  for (int i = 0; i < 6; ++i) {
    pose = pose * Eigen::AngleAxisd(q[i], Vector3::UnitZ()) * Eigen::Translation3d(a[i], 0, d[i]) *
           Eigen::AngleAxisd(alpha[i], Vector3::UnitX());
  }
  return pose;
}

TEST(RobotModel, ForwardKinematicsFollowThePublishedParameters) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const AxisVector q = random_axes(random, 6);
    const Pose expected = hanging_arm().world_from_base * denavit_hartenberg(q) * hanging_arm().tool.flange_from_tip;
    ASSERT_TRUE(model.world_from_tip(q).matrix().isApprox(expected.matrix(), 1e-10)) << q.transpose();
  }
}

TEST(RobotModel, LinksOnTopOfEachOtherComeToTheFlange) {
  auto model = RobotModel::load(hanging_arm()).value();
  const auto links = model.links();
  EXPECT_EQ(model.axis_names().front(), "shoulder_pan_joint");
  EXPECT_EQ(model.axis_names().size(), 6U);
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const AxisVector q = random_axes(random, 3);
    std::vector<Pose> parent_from_link;
    model.place_links(q, parent_from_link);
    ASSERT_EQ(parent_from_link.size(), links.size());
    std::map<std::string, Pose> base_from{{links.front().parent, Pose::Identity()}};
    for (std::size_t link = 0; link < links.size(); ++link) {
      ASSERT_TRUE(base_from.contains(links[link].parent)) << links[link].name << " comes before " << links[link].parent;
      base_from.emplace(links[link].name, base_from.at(links[link].parent) * parent_from_link[link]);
    }
    const Pose tip = hanging_arm().world_from_base * base_from.at("tool0") * hanging_arm().tool.flange_from_tip;
    EXPECT_TRUE(tip.isApprox(model.world_from_tip(q), 1e-9));
  }
  EXPECT_EQ(std::ranges::count_if(links, [](const RobotModel::Link& link) { return !link.fixed; }), 6);
}

TEST(RobotModel, JacobianIsTheDerivativeOfTheTip) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(2);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const AxisVector q = random_axes(random, 3);
    const Jacobian jacobian = model.tip_jacobian(q);
    for (int axis = 0; axis < 6; ++axis) {
      AxisVector low = q, high = q;
      low[axis] -= kStep;
      high[axis] += kStep;
      const Pose from = model.world_from_tip(low), to = model.world_from_tip(high);
      const Eigen::AngleAxisd turn(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
      EXPECT_TRUE(jacobian.col(axis).head<3>().isApprox((to.translation() - from.translation()) / (2 * kStep), 1e-5) ||
                  jacobian.col(axis).head<3>().norm() < 1e-6);
      EXPECT_TRUE(jacobian.col(axis).tail<3>().isApprox(turn.axis() * turn.angle() / (2 * kStep), 1e-5));
    }
  }
}

// At rest the torques must balance the weight of every part: tau = -sum(J_com^T m g), and a known load adds J_load^T m
// g.
TEST(RobotModel, SpeedsAloneAccelerateTheTipByTheJacobiansRate) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(3);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const AxisVector q = random_axes(random, 3), speed = random_axes(random, 2);
    const Jacobian rate = (model.tip_jacobian(q + kStep * speed) - model.tip_jacobian(q - kStep * speed)) / (2 * kStep);
    EXPECT_LT((model.tip_acceleration(q, speed) - rate * speed).norm(), 1e-6) << q.transpose();
  }
}

// Whatever was asked before, and of whichever q: each answer is the one that a model gives which was asked nothing.
TEST(RobotModel, WhatWasReckonedForOneQIsNotTakenForAnother) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(4);
  const std::array<AxisVector, 2> q{random_axes(random, 3), random_axes(random, 3)};
  const AxisVector speed = random_axes(random, 2);
  for (int i = 0; i < 500; ++i) {
    auto fresh = model.copy();
    const AxisVector& at = q[random.uniform(0, 1) < 0.5 ? 0 : 1];
    const int what = static_cast<int>(random.uniform(0, 5));
    AxisVector of[2], rate[2];
    AxisMatrix mass[2];
    if (what == 0) {
      EXPECT_EQ(model.world_from_tip(at).matrix(), fresh.world_from_tip(at).matrix());
    }
    if (what == 1) {
      EXPECT_EQ(model.tip_jacobian(at), fresh.tip_jacobian(at));
    }
    if (what == 2) {
      EXPECT_EQ(model.tip_acceleration(at, speed), fresh.tip_acceleration(at, speed));
    }
    if (what == 3) {
      model.momentum(at, speed, {}, of[0], rate[0]);
      fresh.momentum(at, speed, {}, of[1], rate[1]);
      EXPECT_EQ(of[0], of[1]);
      EXPECT_EQ(rate[0], rate[1]);
    }
    if (what == 4) {
      model.mass_matrix(at, {}, mass[0]);
      fresh.mass_matrix(at, {}, mass[1]);
      EXPECT_EQ(mass[0], mass[1]);
    }
  }
}

TEST(RobotModel, PayloadAddsExactlyItsWeight) {
  const auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  Random random(3);
  const AxisVector still = AxisVector::Zero(6);
  const Payload payload{.mass_kg = 2.5, .com_m = {0.02, -0.01, 0.16}};
  for (int i = 0; i < 100; ++i) {
    const AxisVector q = random_axes(random, 3);
    AxisVector empty, loaded;
    model.inverse_dynamics(q, still, still, {}, empty);
    model.inverse_dynamics(q, still, still, payload, loaded);
    // The load's centre seen from the tip; the Jacobian moves there rigidly.
    const Pose tip = model.world_from_tip(q);
    const Vector3 from_tip = tip.linear() * Vector3(0.02, -0.01, 0.0);
    const Jacobian jacobian = model.tip_jacobian(q);
    for (int axis = 0; axis < 6; ++axis) {
      const Vector3 linear = jacobian.col(axis).head<3>() + Vector3(jacobian.col(axis).tail<3>()).cross(from_tip);
      EXPECT_NEAR(loaded[axis] - empty[axis], 2.5 * 9.81 * linear.z(), 1e-9);
    }
  }
}

// Energy gained per second equals the power put in, whatever the motion: checks inertia and gravity together.
TEST(RobotModel, FirstAxisOfAHangingArmCarriesNoWeight) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(4);
  AxisVector torque;
  for (int i = 0; i < 100; ++i) {
    model.inverse_dynamics(random_axes(random, 3), AxisVector::Zero(6), AxisVector::Zero(6), {}, torque);
    EXPECT_NEAR(torque[0], 0, 1e-9);
  }
}

// The pendulum of the last two links about the shoulder, by hand: only the second axis accelerates, arm stretched
// level.
TEST(RobotModel, StretchedArmWeighsWhatItsPartsWeigh) {
  auto model = RobotModel::load(hanging_arm()).value();
  AxisVector torque;
  model.inverse_dynamics(AxisVector::Zero(6), AxisVector::Zero(6), AxisVector::Zero(6), {}, torque);
  // Masses and the published centres along the arm (x); wrist 1, 2, 3 and tool hang at the wrist.
  const double moment = 8.058 * 0.2125 + 2.846 * (0.425 + 0.2422) + (1.37 + 1.3 + 0.365 + 0.9) * (0.425 + 0.3922);
  // The first axis points down, the arm along -x: the torque that holds it is negative about the second axis.
  EXPECT_NEAR(std::abs(torque[1]), 9.81 * moment, 1e-6);
}

TEST(RobotModel, ForwardDynamicsInvertInverseDynamics) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const AxisVector q = random_axes(random, 3), speed = random_axes(random, 3), wanted = random_axes(random, 20);
    const Payload payload{.mass_kg = random.uniform(0, 3), .com_m = {0, 0.01, 0.2}};
    AxisVector torque, acceleration;
    model.inverse_dynamics(q, speed, wanted, payload, torque);
    model.forward_dynamics(q, speed, torque, payload, acceleration);
    EXPECT_TRUE(acceleration.isApprox(wanted, 1e-8)) << acceleration.transpose() << " | " << wanted.transpose();
  }
}

TEST(RobotModel, ARotorAddsItsInertiaToItsOwnAxisOnly) {
  auto robot = hanging_arm();
  auto model = RobotModel::load(robot).value();
  robot.rotor_inertia_kg_m2 = axis_vector({0.5, 0.4, 0.3, 0.2, 0.1, 0.05});
  auto heavier = RobotModel::load(robot).value();
  Random random(6);
  for (int i = 0; i < 100; ++i) {
    const AxisVector q = random_axes(random, 3), speed = random_axes(random, 3), wanted = random_axes(random, 20);
    AxisVector torque, more;
    model.inverse_dynamics(q, speed, wanted, {}, torque);
    heavier.inverse_dynamics(q, speed, wanted, {}, more);
    const AxisVector added = ((robot.rotor_inertia_kg_m2.array() - 0.01) * wanted.array()).matrix();
    EXPECT_TRUE((more - torque).isApprox(added, 1e-9)) << (more - torque).transpose() << " | " << added.transpose();
  }
}

// Two wheels on a base: no chain, no flange, and joints that turn without end.
TEST(RobotModel, WheelsCountTheirTurnsAndMoveNoTip) {
  const auto world = world::load("worlds", "rounds");
  ASSERT_TRUE(world) << world.error().line();
  auto model = RobotModel::load(world->robot);
  ASSERT_TRUE(model) << model.error().line();
  ASSERT_EQ(model->axes(), 2);
  const AxisVector far = axis_vector({1234.5, -987.6});
  EXPECT_TRUE(model->tip_jacobian(far).isZero());
  EXPECT_TRUE(model->world_from_tip(far).isApprox(Pose::Identity()));
  // Wheel, rotor, and what the drive accelerates of the base; the wheels know nothing of each other.
  AxisMatrix mass;
  model->mass_matrix(far, {}, mass);
  const double each = 0.0075 + 0.01 + 0.01 * (30.0 / 4 + 1.19 / 0.16);
  EXPECT_NEAR(mass(0, 0), each, 1e-9);
  EXPECT_NEAR(mass(1, 1), each, 1e-9);
  EXPECT_NEAR(mass(0, 1), 0, 1e-12);
  AxisVector torque(2);
  model->inverse_dynamics(far, axis_vector({5, 3}), axis_vector({2, -4}), {}, torque);
  EXPECT_TRUE(torque.isApprox(each * axis_vector({2, -4}), 1e-9));
}

TEST(RobotModel, TheMassMatrixIsWhatInverseDynamicsAskForPerAcceleration) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(7);
  for (int i = 0; i < 100; ++i) {
    const AxisVector q = random_axes(random, 3), zero = AxisVector::Zero(6);
    const Payload payload{.mass_kg = random.uniform(0, 3), .com_m = {0, 0.01, 0.2}};
    AxisMatrix mass;
    model.mass_matrix(q, payload, mass);
    AxisVector weight, torque;
    model.inverse_dynamics(q, zero, zero, payload, weight);
    const AxisVector acceleration = random_axes(random, 5);
    model.inverse_dynamics(q, zero, acceleration, payload, torque);
    EXPECT_TRUE((mass * acceleration).isApprox(torque - weight, 1e-9));
  }
}

// dp/dt along a motion with a known acceleration, by differences, is what torques and rate say it is.
TEST(RobotModel, MomentumChangesByTorquesAndItsOwnRate) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(8);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const AxisVector q = random_axes(random, 3), speed = random_axes(random, 3), gain = random_axes(random, 20);
    const Payload payload{.mass_kg = random.uniform(0, 3), .com_m = {0, 0.01, 0.2}};
    AxisVector before, after, here, rate, ignored, torque;
    model.momentum(q, speed, payload, here, rate);
    AxisMatrix mass;
    model.mass_matrix(q, payload, mass);
    EXPECT_TRUE(here.isApprox(mass * speed, 1e-9));
    model.momentum(q - kStep * speed, speed - kStep * gain, payload, before, ignored);
    model.momentum(q + kStep * speed, speed + kStep * gain, payload, after, ignored);
    model.inverse_dynamics(q, speed, gain, payload, torque);
    EXPECT_TRUE(((after - before) / (2 * kStep)).isApprox(torque + rate, 1e-6));
  }
}

TEST(RobotModel, CapsulesMoveWithTheirLinks) {
  auto model = RobotModel::load(hanging_arm()).value();
  std::vector<PlacedCapsule> capsules;
  const AxisVector q = hanging_arm().home;
  model.place_capsules(q, capsules);
  ASSERT_EQ(capsules.size(), 2u);
  EXPECT_TRUE(capsules[1].to.isApprox(model.world_from_tip(q).translation(), 1e-9));
  EXPECT_NEAR((capsules[0].from - capsules[0].to).norm(), 0.3922, 1e-9);
}

TEST(RobotModel, CopyIsIndependentAndEqual) {
  auto model = RobotModel::load(hanging_arm()).value();
  auto copy = model.copy();
  const AxisVector q = hanging_arm().home;
  AxisVector here, there;
  model.inverse_dynamics(q, q, q, {.mass_kg = 3, .com_m = {0, 0, 0.1}}, here);
  copy.inverse_dynamics(q, q, q, {}, there);
  EXPECT_FALSE(here.isApprox(there, 1e-3));
  model.inverse_dynamics(q, q, q, {}, here);
  EXPECT_EQ(here, there);
}

// The same arm, with another value for an attribute of every link.
std::filesystem::path with_all(const std::filesystem::path& urdf, const std::string& attribute,
                               const std::string& value) {
  std::ifstream in(urdf);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  for (auto at = text.find(attribute + "=\""); at != std::string::npos; at = text.find(attribute + "=\"", at + 1)) {
    const auto begin = at + attribute.size() + 2;
    text.replace(begin, text.find('"', begin) - begin, value);
  }
  const auto path = std::filesystem::path(testing::TempDir()) / "weightless.urdf";
  std::ofstream(path) << text;
  return path;
}

// The controller would reckon with an arm that weighs nothing, or with none at all.
TEST(RobotModel, WhatHasNoMassOrInertiaIsRefused) {
  for (const auto& [attribute, value] :
       {std::pair{"value", "0"}, std::pair{"value", "-1"}, std::pair{"value", "inf"}, std::pair{"value", "nan"},
        std::pair{"ixx", "0"}, std::pair{"iyy", "0"}, std::pair{"izz", "0"}, std::pair{"ixx", "inf"},
        std::pair{"izz", "nan"}, std::pair{"ixy", "nan"}, std::pair{"ixy", "inf"}}) {
    auto robot = hanging_arm();
    robot.urdf = with_all(robot.urdf, attribute, value);
    const auto model = RobotModel::load(robot);
    ASSERT_FALSE(model) << attribute << ' ' << value;
    EXPECT_NE(model.error().line().find("has no mass or no inertia"), std::string::npos) << attribute << ' ' << value;
  }
}

TEST(RobotModel, LoadingSaysWhatIsWrong) {
  auto robot = hanging_arm();
  robot.urdf = "no/such.urdf";
  EXPECT_NE(RobotModel::load(robot).error().line().find("no/such.urdf: no such URDF file"), std::string::npos);
  robot = hanging_arm();
  robot.flange_link = "hand";
  EXPECT_NE(RobotModel::load(robot).error().line().find("no link named 'hand'"), std::string::npos);
  robot = hanging_arm();
  robot.limits.jerk_rad_s3 = AxisVector::Constant(5, 400);
  EXPECT_NE(RobotModel::load(robot).error().line().find("'jerk' has 5 values, the URDF 6"), std::string::npos);
  robot = hanging_arm();
  robot.rotor_inertia_kg_m2 = AxisVector::Constant(7, 0.01);
  EXPECT_NE(RobotModel::load(robot).error().line().find("'rotor_inertia_kg_m2' has 7 values, the URDF 6"),
            std::string::npos);
  robot = hanging_arm();
  robot.flange_link = "forearm_link";
  EXPECT_NE(RobotModel::load(robot).error().line().find("does not hang on the last moving joint"), std::string::npos);
  const auto path = std::filesystem::path(testing::TempDir()) / "broken.urdf";
  std::ofstream(path) << "<robot name='x'><link";
  robot = hanging_arm();
  robot.urdf = path;
  EXPECT_NE(RobotModel::load(robot).error().line().find("broken URDF"), std::string::npos);
}

}  // namespace
}  // namespace pons::model
