// The skill follow_trajectory with what others plan for an arm: it may end a little later than they asked.

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "pons/motion/test_plans.hpp"
#include "pons/skills/follow_kit.hpp"

namespace pons::skills {
namespace {

using motion::SampledPlan;
using motion::TimedPoint;
using task::Json;
using task::Progress;
using task::Status;
using ::testing::AllOf;
using ::testing::HasSubstr;

class FollowPlanTest : public FollowKit {
 protected:
  FollowPlanTest() : FollowKit(shipped_world("small_cell")) {}

  // So many corners, as they are planned by default: of MoveIt's limits for this arm, whose accelerations are a quarter
  // of what it can do, the share that its user asks for. The last interval is so long.
  [[nodiscard]] SampledPlan plan(int sides, double share, double last_s) const {
    AxisVector one(7), other(7);
    one << 0.5, -0.2, 0.3, 0.2, 0.4, -0.2, 0.9;
    other << 0.3, -0.1, -0.3, 0.2, -0.5, 0.1, -0.6;
    const AxisLimits& limits = world_.robot.limits;
    return motion::plan_that_ends_after(last_s, motion::laps(home(), one, other, sides), share * limits.speed_rad_s,
                                        0.25 * share * limits.acceleration_rad_s2);
  }
  [[nodiscard]] Json asked(const std::vector<TimedPoint>& points) const {
    Json arguments{{"joints", joints()}, {"points", Json::array()}};
    for (const TimedPoint& point : points)
      arguments["points"].push_back(
          {{"positions", values(point.position)}, {"velocities", values(*point.speed)}, {"time_s", point.time_s}});
    return arguments;
  }
  // How far beside the plan's way the arm is, which it passes at this time or up to 0.1 s earlier.
  [[nodiscard]] double beside(const SampledPlan& plan, double t) const {
    double least = std::numeric_limits<double>::infinity();
    for (double s = t - 0.1; s <= t + 0.001; s += 0.001)
      least = std::min(least, off(plan.at(std::clamp(s, 0.0, plan.duration_s())).position));
    return least;
  }
  void back_home() { ASSERT_EQ(run(kTrajectory, trajectory({{3.0, home()}})).status, Status::kSucceeded); }
};

TEST_F(FollowPlanTest, WhatIsPlannedWithoutAThoughtOfJerkIsDoneHardlyLater) {
  for (const int sides : {1, 2}) {
    for (const double share : {0.1, 0.5, 1.0}) {
      for (const double last_s : {0.001, 0.010, 0.046}) {
        SCOPED_TRACE(testing::Message() << sides << " sides, share " << share << ", last interval " << last_s);
        const SampledPlan planned = plan(sides, share, last_s);
        Json arguments = asked(planned.points());
        arguments["goal_time_tolerance"] = 0.5 + 0.1 * planned.duration_s();
        double worst = 0;
        const Progress end =
            run(kTrajectory, arguments, [&](double t) { worst = std::max(worst, beside(planned, t)); });
        ASSERT_EQ(end.status, Status::kSucceeded) << end.reason;
        EXPECT_LT(worst, 0.003);
        EXPECT_LT(off(planned.points().back().position), 1e-6);
        const double longer_s = end.detail.at("longer_s");
        EXPECT_LT(longer_s, 0.05);
        EXPECT_NEAR(end.detail.at("took_s").get<double>(), planned.duration_s() + longer_s, 0.02);
        if (share == 0.1 && last_s == 0.046) {
          EXPECT_EQ(longer_s, 0) << "nothing is in its way";
        }
        back_home();
      }
    }
  }
}

TEST_F(FollowPlanTest, ItsOwnShareOfTheSpeedLimitsIsKept) {
  const AxisLimits& limits = world_.robot.limits;
  const SampledPlan planned({home(), home({{0, 2.0}})}, limits.speed_rad_s, 0.25 * limits.acceleration_rad_s2);
  Json arguments = asked(planned.points());
  EXPECT_THAT(refusal(kTrajectory, arguments), HasSubstr("is beyond its limit")) << "times are kept";
  arguments["goal_time_tolerance"] = 0.5;
  EXPECT_EQ(refusal(kTrajectory, arguments), "");
  double fastest = 0;
  const Progress end = run(kTrajectory, arguments,
                           [&](double) { fastest = std::max(fastest, cell_.arm.state().speed.cwiseAbs().maxCoeff()); });
  ASSERT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_LE(fastest, cell_.limits_timed().speed_rad_s[0] * (1 + 1e-6));
  EXPECT_GT(end.detail.at("longer_s").get<double>(), 0.01);
  EXPECT_LT(end.detail.at("longer_s").get<double>(), 0.1);
}

TEST_F(FollowPlanTest, WithoutLeaveItsTimesAreKeptOrRefused) {
  const Json arguments = asked(plan(1, 0.5, 0.010).points());
  const Progress end = run(kTrajectory, arguments);
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason,
              AllOf(HasSubstr("times its jerk limit; reach it after "), testing::Not(HasSubstr("are allowed"))));
  EXPECT_EQ(cell_.arm.motion_end(), Time{}) << "nothing moved";
}

TEST_F(FollowPlanTest, LongerThanItMayTakeItIsRefusedWithHowLongItWouldTake) {
  Json arguments = trajectory({{0.4, home({{0, 0.8}})}});
  arguments["goal_time_tolerance"] = 0.05;
  const Progress end = run(kTrajectory, arguments);
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason, AllOf(HasSubstr("point 1: joint1 would need "), HasSubstr(" times as long, "),
                                HasSubstr(" s more, of which 0.05 s are allowed")));
  EXPECT_EQ(cell_.arm.motion_end(), Time{}) << "nothing moved";
  const double more_s = std::stod(end.reason.substr(end.reason.find("as long, ") + 9));
  EXPECT_GT(more_s, 0.1);
  arguments["goal_time_tolerance"] = more_s;
  const Progress longer = run(kTrajectory, arguments);
  EXPECT_EQ(longer.status, Status::kSucceeded) << longer.reason;
  EXPECT_NEAR(longer.detail.at("longer_s").get<double>(), more_s, 0.01);
}

TEST_F(FollowPlanTest, ItHasAsLongAsThatToComeToItsEnd) {
  off_rad_ = 0.025;
  for (const double tolerance_s : {0.1, 0.9}) {
    Json arguments = trajectory({{1.0, home({{0, tolerance_s}})}});
    arguments["goal_time_tolerance"] = tolerance_s;
    const Progress end = run(kTrajectory, arguments);
    EXPECT_EQ(end.status, Status::kFailed);
    EXPECT_THAT(end.reason, HasSubstr("goal_tolerance_violated: "));
    EXPECT_NEAR(end.detail.at("took_s").get<double>(), 1.0 + tolerance_s, 0.02);
  }
}

}  // namespace
}  // namespace pons::skills
