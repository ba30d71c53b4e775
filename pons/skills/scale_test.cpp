#include "pons/skills/scale.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "pons/core/gravity.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(10);
// Four bellows side by side; and as if their folds did not rub.
constexpr double kStiffness_n_m = 4 * 3000, kDamping_n_s_m = 4 * 25, kHardlyDamped_n_s_m = 4 * 5;

// What the scale waits for: the heavier a load, the longer its springs swing it. A tick more, for readings are 10 ms
// apart.
double span_s(double mass_kg) { return std::clamp(0.08 * std::sqrt(mass_kg), 0.05, 0.15); }

// A load below the cups on a damped spring; the flange moves up and down as it is told. Semi-implicit Euler.
class SwingingLoad {
 public:
  // At rest under a spring that bears `share` of its weight.
  SwingingLoad(double mass_kg, double share, double damping_n_s_m)
      : mass_kg_(mass_kg), damping_n_s_m_(damping_n_s_m), sag_m_(share * mass_kg * kGravity_m_s2 / kStiffness_n_m) {}
  [[nodiscard]] double pull_n() const { return kStiffness_n_m * sag_m_ + damping_n_s_m_ * sinking_m_s_; }
  // `borne` of its weight rests on a neighbour.
  void step(double flange_m_s2, double borne, double dt_s) {
    sinking_m_s_ += dt_s * (kGravity_m_s2 * (1 - borne) + flange_m_s2 - pull_n() / mass_kg_);
    sag_m_ += dt_s * sinking_m_s_;
  }

 private:
  double mass_kg_, damping_n_s_m_, sag_m_, sinking_m_s_ = 0;
};

struct Reading {
  double time_s = 0, now_kg = 0;
  std::optional<Weight> weight;
};

class ScaleTest : public ::testing::Test {
 protected:
  // Straight up by `height_m` (which may be 0) within 0.6 s.
  motion::Trajectory lift(double height_m) {
    constexpr double kDuration_s = 0.6;
    const auto path = [&](double t_s) {
      const double u = std::min(1.0, t_s / kDuration_s);
      const double rise_m = height_m * u * u * u * (10 - 15 * u + 6 * u * u);
      Pose tip = Cell::tip_down({0.1, 0, 1.0 + rise_m}, 0.3);
      tip.linear() = Eigen::AngleAxisd(leans_rad_, Vector3(0.6, 0.8, 0)) * tip.linear();
      return cell_.model.inverse(tip, world_.robot.home);
    };
    const auto q = path(0);
    EXPECT_TRUE(q) << q.error().line();
    const AxisVector still = AxisVector::Zero(q->size());
    auto way = motion::follow({*q, still, still}, begin_, path, kDuration_s, 0.02, world_.robot.limits);
    EXPECT_TRUE(way) << way.error().line();
    return way.value_or(motion::Trajectory{});
  }

  // What the wrist feels, and the bridge's tick that weighs it, until the way ends. Before `free_s` a neighbour
  // bears half of the load. Where `tilts_rad_s` is not 0, what hangs beside the cups swings about them so fast.
  std::vector<Reading> weigh(SwingingLoad load, const motion::Trajectory& way, double free_s = 0,
                             const Vector3& hangs_in_tip_m = Vector3::Zero(), double expected_kg = 0,
                             double tilts_rad_s = 0) {
    constexpr int kSubsteps = 40;
    const double dt_s = to_s(kTick) / kSubsteps;
    Scale scale;
    std::vector<Reading> readings;
    double last_speed_m_s = 0;
    for (Time now = begin_; now <= way.back().end(); now += kTick) {
      const double since_s = to_s(now - begin_);
      const AxisState arm = motion::sample(way, now, cell_.model.axes());
      const double speed_m_s = (cell_.model.tip_jacobian(arm.position) * arm.speed)(2);
      const double flange_m_s2 = (speed_m_s - last_speed_m_s) / to_s(kTick);
      for (int i = 0; i < kSubsteps && now > begin_; ++i) {
        const double time_s = since_s + (i - kSubsteps) * dt_s;
        load.step(flange_m_s2, time_s < free_s ? 0.5 : 0, dt_s);
      }
      last_speed_m_s = speed_m_s;
      const double share = tilts_rad_s > 0 ? 1 - std::cos(tilts_rad_s * since_s) : 1;  // of the moment at rest
      hear(now, arm, {load.pull_n(), world_.robot.tool.mass_kg * (kGravity_m_s2 + flange_m_s2)},
           {share * hangs_in_tip_m.x(), share * hangs_in_tip_m.y(), hangs_in_tip_m.z()});
      scale.add(cell_);
      readings.push_back({since_s, weigh_now(cell_), scale.weigh(cell_, expected_kg)});
    }
    return readings;
  }

  struct Pull {
    double load_n, tool_n;
  };

  void hear(Time now, const AxisState& arm, const Pull& pull, const Vector3& hangs_in_tip_m) {
    const Pose& flange_from_tip = world_.robot.tool.flange_from_tip;
    const Pose world_from_flange = cell_.model.world_from_tip(arm.position) * flange_from_tip.inverse();
    const Vector3 down = world_from_flange.linear().transpose() * Vector3(0, 0, -1);
    const Vector3 in_flange_n = (pull.load_n + pull.tool_n) * down;
    const Vector3 moment_nm = (flange_from_tip * hangs_in_tip_m).cross(pull.load_n * down) +
                              world_.robot.tool.com_m.cross(pull.tool_n * down);
    link::State state;
    state.stamp = now;
    state.safety = link::SafetyState::kOperational;
    state.commanded = arm;
    state.position = arm.position, state.speed = arm.speed;
    state.wrist_force_n = {in_flange_n.x(), in_flange_n.y(), in_flange_n.z()};
    state.wrist_torque_nm = {moment_nm.x(), moment_nm.y(), moment_nm.z()};
    cerebellum_.publish(state);
    cell_.refresh(now, {});
    for (link::Command command; cerebellum_.receive(command);) continue;
  }

  static void expect_right(const std::vector<Reading>& readings, double mass_kg, double from_s, double to_s,
                           double share = 0.05) {
    int read = 0;
    for (const Reading& reading : readings) {
      if (reading.time_s < from_s || reading.time_s > to_s) continue;
      ASSERT_TRUE(reading.weight) << mass_kg << " kg after " << reading.time_s << " s";
      EXPECT_NEAR(reading.weight->mass_kg, mass_kg, share * mass_kg) << "after " << reading.time_s << " s";
      ++read;
    }
    EXPECT_GT(read, 5);
  }

  const Time begin_ = Time(from_s(4));
  double leans_rad_ = 0;  // the tool
  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  Cell cell_{bridge_, world_, model::RobotModel::load(world_.robot).value()};
};

// A light one, taken from where it leant on another: the tool is heavier than it is.
TEST_F(ScaleTest, WhereALoadHangsIsFeltWithALeaningTool) {
  cell_.held = Held{"P1", {.size_m = {0.2, 0.15, 0.06}}, 0};
  for (const double leans_rad : {0.0, 0.25, -0.25}) {
    leans_rad_ = leans_rad;
    const auto readings = weigh({0.12, 1, kDamping_n_s_m}, lift(0.1), 0, {0.02, -0.01, 0.03});
    ASSERT_TRUE(readings.back().weight);
    const Eigen::Vector2d off_m = readings.back().weight->beside_tip_m - Eigen::Vector2d(0.02, -0.01);
    EXPECT_LT(off_m.norm(), 0.003) << leans_rad;
  }
}

TEST_F(ScaleTest, HeldStillALoadThatSwingsIsWeighedOverTheSwing) {
  for (const double mass_kg : {0.5, 2.0, 3.5}) {
    const auto readings = weigh({mass_kg, 0.8, kHardlyDamped_n_s_m}, lift(0));
    const auto [least, most] = std::ranges::minmax(readings, {}, &Reading::now_kg);
    EXPECT_GT(most.now_kg - least.now_kg, 0.2 * mass_kg) << "it must swing, or any force would do";
    expect_right(readings, mass_kg, span_s(mass_kg) + 0.011, 1);
  }
}

TEST_F(ScaleTest, WhileTheArmSpeedsUpAndSlowsDownTheMassStaysRight) {
  for (const double mass_kg : {0.5, 2.0, 3.5}) {
    const auto readings = weigh({mass_kg, 1, kDamping_n_s_m}, lift(0.25));
    const auto [least, most] = std::ranges::minmax(readings, {}, &Reading::now_kg);
    EXPECT_GT(most.now_kg - mass_kg, 0.25 * mass_kg) << "inertia must weigh along";
    expect_right(readings, mass_kg, span_s(mass_kg) + 0.011, 1, 0.07);
  }
}

TEST_F(ScaleTest, FeelsWhereTheLoadHangs) {
  for (const Vector3& hangs_m : {Vector3(0, 0, 0.1), Vector3(0.06, 0, 0.05), Vector3(-0.04, 0.15, 0.2)}) {
    int read = 0;
    for (const Reading& reading : weigh({1.0, 0.8, kHardlyDamped_n_s_m}, lift(0.1), 0, hangs_m)) {
      if (!reading.weight) continue;
      EXPECT_LT((reading.weight->beside_tip_m - hangs_m.head<2>()).norm(), 0.003) << "after " << reading.time_s << " s";
      ++read;
    }
    EXPECT_GT(read, 5);
  }
}

// Three tilts a second: by the last tenth of one it would hang where the load's own middle is, or twice as far beside.
TEST_F(ScaleTest, WhatTiltsTheCupsIsFeltWhereItHangsThroughoutTheLift) {
  const Vector3 hangs_m(0, 0.12, 0.05);
  int read = 0;
  for (const Reading& reading : weigh({0.7, 1, kDamping_n_s_m}, lift(0.25), 0, hangs_m, 0, 20)) {
    if (!reading.weight || reading.time_s < 0.3) continue;
    EXPECT_LT((reading.weight->beside_tip_m - hangs_m.head<2>()).norm(), 0.25 * hangs_m.y())
        << "after " << reading.time_s << " s";
    ++read;
  }
  EXPECT_GT(read, 20);
}

TEST_F(ScaleTest, WhatFellOffMeanwhileIsFeltNoMore) {
  const AxisState still = motion::sample(lift(0), begin_, cell_.model.axes());
  Scale scale;
  for (int i = 0; i < 60; ++i) {
    const double mass_kg = i < 30 ? 2.0 : 0.5, aside_m = i < 30 ? 0.15 : 0;
    hear(begin_ + i * kTick, still, {mass_kg * kGravity_m_s2, world_.robot.tool.mass_kg * kGravity_m_s2},
         {aside_m, 0, 0.05});
    scale.add(cell_);
  }
  const std::optional<Weight> weight = scale.weigh(cell_, 0);
  ASSERT_TRUE(weight);
  EXPECT_NEAR(weight->mass_kg, 0.5, 0.02);
  EXPECT_LT(weight->beside_tip_m.norm(), 0.005);
}

TEST_F(ScaleTest, SaysNothingBeforeASwingIsOver) {
  for (const auto& [mass_kg, ticks] : {std::pair{0.2, 5}, {1.0, 8}, {3.5, 15}}) {
    int early = 0;
    for (const Reading& reading : weigh({mass_kg, 1, kDamping_n_s_m}, lift(0.1))) {
      if (reading.weight) break;
      ++early;
    }
    EXPECT_GE(early, ticks) << mass_kg << " kg";
    EXPECT_LE(early, ticks + 2) << mass_kg << " kg";
  }
}

// Felt alone, it would be a lighter load, and weighed sooner: by its size it is expected to be what it is.
TEST_F(ScaleTest, SaysNothingWhileANeighbourBoreHalfOfItInTheFirstHalf) {
  for (const auto& [mass_kg, free_s] : {std::pair{2.0, 0.04}, {2.0, 0.06}, {2.0, 0.08}, {3.5, 0.08}}) {
    const auto readings = weigh({mass_kg, 0.5, kDamping_n_s_m}, lift(0), free_s, Vector3::Zero(), mass_kg);
    int doubtful = 0;
    for (const Reading& reading : readings) {
      if (reading.time_s > free_s + span_s(mass_kg)) break;
      if (reading.weight) {
        EXPECT_NEAR(reading.weight->mass_kg, mass_kg, 0.2 * mass_kg) << "after " << reading.time_s << " s";
      } else if (reading.time_s > span_s(mass_kg)) {
        ++doubtful;
      }
    }
    EXPECT_GE(doubtful, 2);
    expect_right(readings, mass_kg, free_s + span_s(mass_kg) + 0.011, 1);
  }
}

}  // namespace
}  // namespace pons::skills
