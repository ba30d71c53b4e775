#include "pons/skills/grasp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "pons/skills/test_kit.hpp"

namespace pons::skills {
namespace {

constexpr double kStep_s = 0.005, kPeak_m_s2 = 5.0;

class LiftTest : public ::testing::Test {
 protected:
  void SetUp() override {
    link::State state;
    state.commanded.position = state.position = world_.robot.home;
    state.belt_speed_m_s = belt_.x();
    cerebellum_.publish(state);
    cell_.refresh(kBegin, {});
    ASSERT_EQ(cell_.belt_speed_m_s(), belt_.x());
  }

  // The arm's tip on a parcel, as fast as the belt or at rest.
  AxisState touching(const Vector3& at, bool riding) {
    AxisState state;
    state.position = cell_.model.inverse(Cell::tip_down(at, 0.3), world_.robot.home).value();
    state.speed = state.acceleration = AxisVector::Zero(state.position.size());
    if (riding) state.speed = joint_speed(cell_, state.position, belt_);
    return state;
  }
  Lift lift(const AxisState& start, const Vector3& offset) {
    const Eigen::Matrix3d orientation = cell_.model.world_from_tip(start.position).linear();
    auto up = skills::lift(cell_, start, kBegin, orientation, offset, kPeak_m_s2);
    EXPECT_TRUE(up) << up.error().line();
    return std::move(*up);
  }
  AxisState state(const Lift& lift, double after_s) {
    return motion::sample(lift.trajectory, kBegin + from_s(after_s), cell_.model.axes());
  }
  Vector3 tip(const Lift& lift, double after_s) {
    return cell_.model.world_from_tip(state(lift, after_s).position).translation();
  }
  static double top_s(const Lift& lift) { return to_s(lift.top - kBegin); }

  static constexpr Time kBegin{std::chrono::seconds(7)};
  const world::World world_ = parcel_cell();
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd cerebellum_{*link_};
  Cell cell_{bridge_, world_, model::RobotModel::load(world_.robot).value()};
  const Vector3 belt_{0.22, 0, 0}, place_{-0.2, 0.05, 0.97};
};

TEST_F(LiftTest, TakesLongerWhenItIsToBeSofter) {
  const AxisState start = touching(place_, true);
  const Eigen::Matrix3d orientation = cell_.model.world_from_tip(start.position).linear();
  const auto hard = skills::lift(cell_, start, kBegin, orientation, {0, 0, 0.1}, kPeak_m_s2 / 4);
  const auto soft = skills::lift(cell_, start, kBegin, orientation, {0, 0, 0.1}, kPeak_m_s2 / 16);
  ASSERT_TRUE(hard && soft);
  EXPECT_NEAR(top_s(*soft), 2 * top_s(*hard), 1e-6);
}

TEST_F(LiftTest, GoesStraightUpOverTheBeltThatMovesOn) {
  for (const double height_m : {0.10, 0.25}) {
    const Lift up = lift(touching(place_, true), {0, 0, height_m});
    for (double t = 0; t < top_s(up) + 0.25; t += kStep_s) {
      const Vector3 over_belt = tip(up, t) - t * belt_;
      EXPECT_LT((over_belt - place_).head<2>().norm(), 0.002) << t;
      EXPECT_LT(over_belt.z() - place_.z(), height_m + 0.0005) << t;
    }
    EXPECT_NEAR(tip(up, top_s(up)).z() - place_.z(), height_m, 0.0005);
  }
}

TEST_F(LiftTest, IsSoftAndEndsAtRestWithinTheLimits) {
  const Lift up = lift(touching(place_, true), {0, 0, 0.12});
  EXPECT_LE(motion::limit_use(up.trajectory, world_.robot.limits).worst(), 1 + 1e-6);
  for (double t = kStep_s; t < top_s(up); t += kStep_s) {
    const double acceleration_m_s2 =
        (tip(up, t - kStep_s) - 2 * tip(up, t) + tip(up, t + kStep_s)).z() / (kStep_s * kStep_s);
    EXPECT_LT(std::abs(acceleration_m_s2), 5.5) << t;
  }
  EXPECT_TRUE(state(up, to_s(up.trajectory.back().end() - kBegin)).speed.isZero(1e-9));
}

TEST_F(LiftTest, LeavesToTheSideAndAlsoStartsAtRest) {
  const Vector3 offset{0.02, -0.01, 0.1};
  for (const bool riding : {true, false}) {
    const Lift up = lift(touching(place_, riding), offset);
    const Vector3 moved = tip(up, top_s(up)) - top_s(up) * belt_ - place_;
    EXPECT_LT((moved - offset).norm(), 0.001) << riding;
  }
}

// Else what is put back beside its neighbours comes down on one of them.
TEST_F(LiftTest, KeepsItsPlaceOnABeltThatGainsSpeed) {
  constexpr double kGains_m_s2 = 0.15;
  link::State state;
  state.commanded.position = state.position = world_.robot.home;
  for (int i = 0; i <= 100; ++i) {
    state.belt_speed_m_s = belt_.x() + 0.01 * (i - 100) * kGains_m_s2;
    cerebellum_.publish(state);
    cell_.refresh(kBegin + from_s(0.01 * (i - 100)), {});
  }
  const Lift up = lift(touching(place_, true), {0, 0, 0.1});
  const double takes_s = top_s(up), belt_m = takes_s * belt_.x() + 0.5 * kGains_m_s2 * takes_s * takes_s;
  EXPECT_NEAR(tip(up, takes_s).x() - place_.x(), belt_m, 0.001);
  EXPECT_NEAR(tip(up, takes_s + 0.2).x() - place_.x(), belt_m + 0.2 * (belt_.x() + takes_s * kGains_m_s2), 0.001);
}

TEST_F(LiftTest, OutOfReachIsAnError) {
  const AxisState start = touching(place_, true);
  const Eigen::Matrix3d orientation = cell_.model.world_from_tip(start.position).linear();
  EXPECT_FALSE(skills::lift(cell_, start, kBegin, orientation, {0, 0, 3.0}, kPeak_m_s2));
}

class GraspTest : public LiftTest {
 protected:
  ObjectBelief parcel(std::uint32_t track, const Vector3& top, const Vector3& size_m) const {
    ObjectBelief belief;
    belief.track = track;
    belief.code = std::to_string(track);
    belief.stamp = kBegin;
    belief.world_from_top = pose_xyz_yaw(top.x(), top.y(), top.z(), 0.1);
    belief.velocity_m_s = belt_;
    belief.size_m = size_m;
    return belief;
  }
  // Of the first parcel; asked for again where a tick is too short.
  Expected<Grasp> grasp_within(int ticks, const AxisState& start) {
    GraspSearch search;
    for (;;) {
      cell_.router.refresh();
      auto grasp = plan_grasp(cell_, start, kBegin, *cell_.find("1"), std::nullopt, search);
      if (grasp || !cell_.router.spent() || --ticks == 0) return grasp;
    }
  }
};

TEST_F(GraspTest, ATallerNeighbourBehindIsNotInTheWayFromAnyChute) {
  // While the arm comes, it moves to where the parcel is now.
  for (const double x : {-0.55, -0.48}) {
    cell_.refresh(kBegin, {parcel(1, {x, -0.035, 1.06}, {0.17, 0.17, 0.16}),
                           parcel(2, {x - 0.259, -0.073, 1.08}, {0.35, 0.25, 0.18})});
    for (const world::Place& place : world_.places) {
      if (place.kind != world::PlaceKind::kChute) continue;
      const AxisState start = touching(place.center_m + Vector3(0, 0, 0.12), false);
      const auto grasp = grasp_within(3, start);
      ASSERT_TRUE(grasp) << place.name << ": " << grasp.error().line();
      const Vector3 meets = cell_.predict(*cell_.find("1"), grasp->contact);
      EXPECT_LT((grasp->contact_point - meets).head<2>().norm(), 0.001) << place.name;
    }
  }
}

TEST_F(GraspTest, MeetsASmallOneLaterWhenOnlyAWayRoundATallOneIsClear) {
  const Vector3 top(-0.36, 0.048, 0.971);
  ObjectBelief tall = parcel(2, top, {0.35, 0.21, 0.17});
  tall.world_from_top = pose_xyz_yaw(top.x() - 0.235, top.y() - 0.076, top.z() + 0.10, 0.346);
  cell_.refresh(kBegin, {parcel(1, top, {0.14, 0.10, 0.07}), tall});
  const AxisState start = touching(world_.place("chute_6")->center_m + Vector3(0, 0, 0.12), false);
  const auto grasp = grasp_within(3, start);
  EXPECT_TRUE(grasp) << grasp.error().line();
}

TEST_F(GraspTest, MeetsAParcelNoLaterOnTheStraightWay) {
  for (const double x : {-0.6, -0.4, -0.2}) {
    const Vector3 top(x, 0.03, 0.98);
    cell_.refresh(kBegin,
                  {parcel(1, top, {0.14, 0.10, 0.08}), parcel(2, top + Vector3(0.25, 0, 0.1), {0.2, 0.2, 0.18})});
    const AxisState start = touching(world_.place("chute_2")->center_m + Vector3(0, 0, 0.12), false);
    const auto meeting = meet_straight(cell_, start, kBegin, *cell_.find("1"), std::nullopt);
    const auto grasp = grasp_within(3, start);
    ASSERT_TRUE(meeting && grasp);
    EXPECT_LT(meeting->ahead_s, to_s(grasp->hover - kBegin) + 0.01) << x;
    EXPECT_GT(meeting->ahead_s, 0.1) << x;
    EXPECT_EQ(meeting->orientation, grasp->orientation) << x;
    const Vector3 over = cell_.predict(*cell_.find("1"), kBegin + from_s(meeting->ahead_s));
    EXPECT_LT((meeting->hover - over).head<2>().norm(), 0.05) << x;
    EXPECT_GT(meeting->hover.z(), over.z()) << x;
  }
}

TEST_F(GraspTest, TheToolLeansWithALeaningTopUpToALimit) {
  for (const double lean_rad : {0.3, 0.52, 0.9}) {
    ObjectBelief leaning = parcel(1, {-0.3, 0.03, 1.0}, {0.14, 0.11, 0.09});
    leaning.world_from_top.rotate(Eigen::AngleAxisd(lean_rad, Vector3::UnitY()));
    cell_.refresh(kBegin, {leaning});
    const AxisState start = touching(world_.place("chute_2")->center_m + Vector3(0, 0, 0.12), false);
    const auto grasp = grasp_within(3, start);
    ASSERT_EQ(grasp.has_value(), lean_rad < 0.6) << lean_rad;
    if (!grasp) continue;
    const Vector3 out = grasp->orientation.col(2);
    EXPECT_NEAR(out.dot(leaning.world_from_top.linear().col(2)), -1, 1e-6) << lean_rad;
  }
}

// As high in its middle as a thick one, of which one edge stands on the belt.
TEST_F(GraspTest, WhatLeansIsAsThickAsItIs) {
  const Vector3 size_m(0.36, 0.14, 0.05);
  for (const double lean_rad : {0.0, 0.2, -0.35}) {
    ObjectBelief object = parcel(1, {-0.3, 0.03, 1.0}, size_m);
    object.world_from_top.rotate(Eigen::AngleAxisd(lean_rad, Vector3::UnitY()));
    object.size_m.z() = size_m.z() * std::cos(lean_rad) + 0.5 * size_m.x() * std::abs(std::sin(lean_rad));
    const Eigen::Matrix3d orientation = Cell::tip_down({-0.3, 0.03, 1.0}, 0.7).linear();
    const Load load = load_of(object, orientation);
    EXPECT_TRUE(load.size_m.isApprox(size_m, 1e-9)) << lean_rad << ": " << load.size_m.transpose();
    EXPECT_NEAR(load.yaw_in_tip_rad, 0.6, 0.03) << lean_rad;
  }
}

TEST_F(GraspTest, ALiftGoesOverWhatStandsCloseAndAwayFromIt) {
  const ObjectBelief target = parcel(1, {-0.3, 0, 1.0}, {0.14, 0.10, 0.10});
  cell_.refresh(kBegin, {target});
  const Vector3 alone = lift_offset(cell_, target);
  EXPECT_EQ(alone.head<2>().norm(), 0);
  EXPECT_GT(alone.z(), 0.08);
  cell_.refresh(kBegin, {target, parcel(2, {-0.5, 0, 1.05}, {0.2, 0.2, 0.15})});
  const Vector3 beside = lift_offset(cell_, target);
  EXPECT_GT(beside.x(), 0.01);
  EXPECT_GT(1.0 - target.size_m.z() + beside.z(), 1.05) << "its underside over the other's top";
  cell_.refresh(kBegin, {target, parcel(2, {-0.8, 0, 1.05}, {0.2, 0.2, 0.15})});
  EXPECT_EQ(lift_offset(cell_, target), alone) << "far away it does not matter";
}

}  // namespace
}  // namespace pons::skills
