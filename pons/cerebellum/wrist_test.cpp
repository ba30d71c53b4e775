#include "pons/cerebellum/wrist.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "pons/cerebellum/test_bench.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;

constexpr double kRate = 2.0;  // rad/s, of a motion without rest

AxisState swinging(double t) {
  AxisState state{bench_robot().home, AxisVector(6), AxisVector(6)};
  for (Eigen::Index axis = 0; axis < 6; ++axis) {
    const double phase = kRate * t + static_cast<double>(axis);
    state.position[axis] += 0.4 * std::sin(phase);
    state.speed[axis] = 0.4 * kRate * std::cos(phase);
    state.acceleration[axis] = -0.4 * kRate * kRate * std::sin(phase);
  }
  return state;
}

// m (g - d²r/dt²) by differences of where the mass really goes.
TEST(Wrist, WhatItCarriesPullsByWeightAndInertia) {
  auto model = bench_model();
  const model::Payload payload{.mass_kg = 1.5, .com_m = {0.02, -0.01, 0.25}};
  const world::Tool& tool = bench_robot().tool;
  for (const double t : {0.0, 0.3, 0.7, 1.9}) {
    const auto flange_at = [&](double time) -> Pose {
      return model.world_from_tip(swinging(time).position) * tool.flange_from_tip.inverse();
    };
    constexpr double kStep = 1e-4;
    const Pose flange = flange_at(t);
    Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
    for (const auto& [mass, com] : {std::pair{tool.mass_kg, tool.com_m}, std::pair{1.5, Vector3(0.02, -0.01, 0.25)}}) {
      const Vector3 gain =
          (flange_at(t + kStep) * com - 2 * (flange * com) + flange_at(t - kStep) * com) / (kStep * kStep);
      const Vector3 pull = flange.linear().transpose() * (mass * (Vector3(0, 0, -9.81) - gain));
      force += pull;
      moment += com.cross(pull);
    }
    const Vector6 carried = carried_wrench(model, swinging(t), payload);
    EXPECT_LT((carried.head<3>() - force).norm(), 0.05) << t;
    EXPECT_LT((carried.tail<3>() - moment).norm(), 0.01) << t;
  }
}

// A sensor that is off by some newtons is learnt while the arm swings, and a push is felt without it.
TEST(Wrist, LearnsItsBiasWithoutRestAndFeelsAPushWithoutIt) {
  auto model = bench_model();
  WristSense wrist(0.5);
  const model::Payload none;
  Vector6 bias;
  bias << 4, -7, 11, 0.3, -0.2, 0.1;
  body::Sensors sensors;
  const auto feel = [&](double t, const Vector6& push, WristSense::Bias learn) {
    const Vector6 felt = carried_wrench(model, swinging(t), none) + bias + push;
    for (Eigen::Index i = 0; i < 3; ++i) {
      sensors.wrist_force_n[static_cast<std::size_t>(i)] = felt[i];
      sensors.wrist_torque_nm[static_cast<std::size_t>(i)] = felt[i + 3];
    }
    wrist.feel(model, swinging(t), none, sensors, learn, 1e-3);
  };
  double t = 0;
  for (; t < 5; t += 1e-3) feel(t, Vector6::Zero(), WristSense::Bias::kLearn);
  EXPECT_LT(wrist.at_tip().norm(), 0.01);
  Vector6 push;  // at the tip, tip axes: seen from the flange it also has a moment
  push << 3, 0, -20, 3 * 0.0, 3 * 0.16, 0;
  for (; t < 6; t += 1e-3) feel(t, push, WristSense::Bias::kKeep);
  EXPECT_NEAR(wrist.at_tip()[0], 3, 0.01);
  EXPECT_NEAR(wrist.at_tip()[2], -20, 0.01);
  EXPECT_LT(wrist.at_tip().tail<3>().norm(), 0.01);
}

}  // namespace
}  // namespace pons::cerebellum
