// The skills that go through points at given times: follow_trajectory and follow_path.

#include "pons/skills/follow_trajectory.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/model/collision.hpp"
#include "pons/skills/follow_kit.hpp"
#include "pons/skills/skills.hpp"
#include "pons/task/schema.hpp"

namespace pons::skills {
namespace {

using task::Json;
using task::Moment;
using task::Progress;
using task::Status;
using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

world::World with_post(world::World world, const Vector3& at) {
  world.places.push_back({"post", world::PlaceKind::kObstacle, at, {0.03, 0.03, 0.2}});
  return world;
}

class FollowTest : public FollowKit {
 protected:
  // A posture, and the way there high in the air.
  [[nodiscard]] AxisVector folded_onto_itself() {
    model::CollisionModel judge(cell_.model.copy(), {.self_m = 0.0});
    Random random(5);
    for (int draw = 0; draw < 5000; ++draw) {
      AxisVector q = home();
      for (const int axis : {1, 2, 3, 4, 5}) q[axis] = random.uniform(-2.8, 2.8);
      double lowest = 10;
      for (int i = 0; i <= 20; ++i)
        lowest = std::min(lowest, cell_.model.world_from_tip(home() + 0.05 * i * (q - home())).translation().z());
      if (lowest > world_.belt.surface_z_m + 0.15 && !judge.clear(q)) return q;
    }
    ADD_FAILURE() << "none found";
    return home();
  }
  // A parcel on the belt that stands.
  void sees(const std::string& code, const Vector3& top) {
    ObjectBelief object;
    object.track = 1;
    object.code = code;
    object.stamp = now_;
    object.world_from_top.translation() = top;
    object.size_m = {0.3, 0.3, 0.25};
    seen_ = {object};
  }
};

TEST_F(FollowTest, IsAtEachPointAtItsTime) {
  const std::vector<std::pair<double, AxisVector>> points{
      {1.0, home({{0, 0.3}})}, {1.8, home({{0, 0.5}, {5, -0.6}})}, {3.0, home({{0, -0.2}, {3, 0.2}})}};
  std::size_t met = 0;
  const Progress end = run(kTrajectory, trajectory(points), [&](double t) {
    for (const auto& [time_s, q] : points) {
      if (std::abs(t - time_s) > 1e-6) continue;
      ++met;
      EXPECT_LT(off(q), 1e-6) << time_s;
    }
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_EQ(met, points.size());
  EXPECT_LT(off(points.back().second), 1e-6);
  EXPECT_EQ(end.detail.at("points"), 3);
  EXPECT_EQ(end.detail.at("progress"), 1.0);
  EXPECT_NEAR(end.detail.at("took_s").get<double>(), 3.0, 0.02);
}

TEST_F(FollowTest, PassesPointsWithTheSpeedsThatAreGiven) {
  Json arguments = trajectory({{1.0, home({{0, 0.3}})}, {2.0, home({{0, 0.6}})}});
  arguments["points"][0]["velocities"] = values(home({{0, 0.45}}) - home());
  double speed = 0;
  const Progress end = run(kTrajectory, arguments, [&](double t) {
    if (std::abs(t - 1.0) < 0.006) speed = cell_.arm.state().speed[0];
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_NEAR(speed, 0.45, 0.01);
}

TEST_F(FollowTest, APointAtTimeZeroIsWhereItHasToRest) {
  EXPECT_EQ(run(kTrajectory, trajectory({{0, home({{2, 0.009}})}, {1.0, home({{0, 0.3}})}})).status,
            Status::kSucceeded);
  EXPECT_LT(off(home({{0, 0.3}})), 1e-6);
  EXPECT_EQ(run(kTrajectory, trajectory({{0, home({{0, 0.3}})}})).status, Status::kSucceeded) << "it is there";
  const Time moved = cell_.arm.motion_end();
  const std::string name = cell_.model.axis_names()[2];
  const Progress elsewhere = run(kTrajectory, trajectory({{0, home({{0, 0.3}, {2, 0.2}})}, {1.0, home()}}));
  EXPECT_EQ(elsewhere.status, Status::kFailed);
  EXPECT_THAT(elsewhere.reason, AllOf(HasSubstr(name + " rests at "), HasSubstr("0.2000 rad off point 1"),
                                      HasSubstr("plan from where the arm is")));
  EXPECT_EQ(cell_.arm.motion_end(), moved) << "nothing moved";
  const Progress quick = run(kTrajectory, trajectory({{0, home({{0, 0.3}})}, {0.3, home({{0, -0.5}})}}));
  EXPECT_THAT(quick.reason, HasSubstr("point 2: ")) << "it counts as one";
}

TEST_F(FollowTest, OffItsWayByMoreThanItsToleranceItStops) {
  Json arguments = trajectory({{2.0, home({{0, 0.6}})}});
  arguments["path_tolerance"] = 0.02;
  EXPECT_EQ(run(kTrajectory, arguments).status, Status::kSucceeded);
  arguments["points"] = trajectory({{2.0, home()}})["points"];
  const Progress end = run(kTrajectory, arguments, [&](double t) { off_rad_ = t > 1 ? 0.03 : 0; });
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason, HasSubstr("path_tolerance_violated: " + cell_.model.axis_names()[1] +
                                    " is 0.0300 rad off its way, of which 0.0200 are allowed"));
  EXPECT_GT(off(home()), 0.05) << "it has stopped on its way";
  EXPECT_GE(now_, cell_.arm.motion_end()) << "and rests";
}

TEST_F(FollowTest, RefusesByNameWhatMakesNoSense) {
  const Json good = trajectory({{1.0, home({{0, 0.3}})}, {2.0, home()}});
  EXPECT_EQ(refusal(kTrajectory, good), "");
  const auto says = [&](const std::function<void(Json&)>& change) {
    Json changed = good;
    change(changed);
    return refusal(kTrajectory, changed);
  };
  const std::string first = cell_.model.axis_names().front(), last = cell_.model.axis_names().back();
  EXPECT_THAT(says([](Json& a) { a["joints"][2] = "elbow"; }), HasSubstr("the arm has no joint 'elbow'; name each of"));
  EXPECT_THAT(says([&](Json& a) { a["joints"][0] = first; }), HasSubstr("joint '" + first + "' is named twice"));
  EXPECT_THAT(says([](Json& a) { a["joints"].erase(0); }), HasSubstr("joint '" + last + "' is missing"));
  EXPECT_THAT(says([](Json& a) { a["points"][1]["positions"].erase(0); }),
              HasSubstr("point 2 has 5 positions for 6 joints"));
  EXPECT_THAT(says([](Json& a) { a["points"][0]["velocities"] = {0.1}; }),
              HasSubstr("point 1 has 1 velocities for 6 joints"));
  EXPECT_THAT(says([](Json& a) { a["points"][0]["time_s"] = -1; }),
              HasSubstr("point 1: -1 s is not at least 0.001 s after the begin; leave out where the arm already is"));
  EXPECT_THAT(says([](Json& a) {
                a["points"][0]["time_s"] = 0;
                a["points"][0]["velocities"] = {0, 0, 0, 0, 0, 0.1};
              }),
              HasSubstr("point 1 is where it begins, and has a speed"));
  EXPECT_THAT(says([](Json& a) { a["points"][1]["time_s"] = 1.0; }),
              HasSubstr("point 2: 1 s is not at least 0.001 s after point 1, at 1 s"));
  EXPECT_THAT(says([](Json& a) { a["points"][1]["time_s"] = 301; }), HasSubstr("due after 301 s, which is too long"));
  EXPECT_THAT(says([](Json& a) { a["points"][0]["positions"][5] = 7; }),
              HasSubstr("point 1: " + first + " at 7.0000 rad is outside its limits"));
  EXPECT_THAT(says([](Json& a) { a["points"][0]["velocities"] = {0, 0, 0, 0, 0, 4}; }),
              HasSubstr("point 1: " + first + " with 4.0000 rad/s is beyond its limit"));
  EXPECT_THAT(says([](Json& a) { a["points"][1]["velocities"] = {0, 0, 0, 0, 0, 0.1}; }),
              HasSubstr("point 2 is the last, and has a speed; end at rest"));
  EXPECT_THAT(says([](Json& a) { a["points"][1]["time_s"] = 1.05; }),
              AllOf(HasSubstr("point 2: " + first + " turns 0.300 rad in 0.050 s, which takes 0.098 s"),
                    HasSubstr("reach it after 1.098 s or later")));
}

TEST_F(FollowTest, TheFormOfItsArgumentsIsChecked) {
  const auto schema = task::Schema::compile(registry_.find(kTrajectory)->schema);
  ASSERT_TRUE(schema) << schema.error().line();
  const auto says = [&](const Json& arguments) {
    const auto good = schema->check(arguments);
    return good ? "" : good.error().line();
  };
  Json good = trajectory({{1.0, home()}});
  EXPECT_EQ(says(good), "");
  Json many = good;
  for (std::size_t k = 0; k < kMostTrajectoryPoints; ++k) many["points"].push_back(good["points"][0]);
  EXPECT_THAT(says(many), HasSubstr("/points: 201 items are too many"));
  good["points"][0]["efforts"] = {1};
  EXPECT_THAT(says(good), HasSubstr("/points/0: 'efforts' does not belong there"));
  EXPECT_THAT(says({{"joints", {"a"}}, {"points", Json::array()}}), HasSubstr("/points: 0 items are too few"));
}

// ---- what the limits say, from where the arm stands ----

TEST_F(FollowTest, WhatIsTooQuickIsRefusedWithTheQuickestTimeAndGoesInThat) {
  const std::string first = cell_.model.axis_names().front();
  const Progress end = run(kTrajectory, trajectory({{0.4, home({{0, 0.8}})}, {2.0, home()}}));
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason, AllOf(HasSubstr("point 1: " + first + " would need 1."), HasSubstr(" limit; reach it after "),
                                HasSubstr(" s at the soonest, not 0.40 s")));
  EXPECT_EQ(cell_.arm.motion_end(), Time{}) << "nothing moved";
  const double quickest = std::stod(end.reason.substr(end.reason.find("after ") + 6));
  EXPECT_EQ(run(kTrajectory, trajectory({{quickest, home({{0, 0.8}})}, {2.0, home()}})).status, Status::kSucceeded);
}

TEST_F(FollowTest, WithALoadOnTheCupsItIsRefusedWhatTheyWouldLose) {
  const std::vector<std::pair<double, AxisVector>> points{{0.62, home({{0, 0.9}})}};
  EXPECT_EQ(run(kTrajectory, trajectory(points)).status, Status::kSucceeded);
  EXPECT_EQ(run(kTrajectory, trajectory({{2.0, home()}})).status, Status::kSucceeded);
  cell_.held = held_;
  cell_.held->mass_kg = 3;
  opened_ = false;
  const Progress end = run(kTrajectory, trajectory(points));
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason, HasSubstr("what the cups hold cannot be carried so quickly; take "));
  const double quickest = std::stod(end.reason.substr(end.reason.find("take ") + 5));
  EXPECT_GT(quickest, 0.65);
  const Progress slowly = run(kTrajectory, trajectory({{quickest, home({{0, 0.9}})}}));
  EXPECT_EQ(slowly.status, Status::kSucceeded) << slowly.reason;
}

// ---- what is in the way ----

TEST_F(FollowTest, WhatItWouldTouchIsNamed) {
  const double low_z = world_.belt.surface_z_m - 0.02;
  const Vector3 here = tip_now();
  const Progress belt = run(kPath, path({{4.0, {here.x(), 0, low_z}}}));
  EXPECT_EQ(belt.status, Status::kFailed);
  EXPECT_THAT(belt.reason, HasSubstr("the belt"));
  sees("P7", {here.x() + 0.3, 0, world_.belt.surface_z_m + 0.25});
  pass();
  const Progress parcel = run(kPath, path({{4.0, {here.x() + 0.3, 0, world_.belt.surface_z_m + 0.1}}}));
  EXPECT_EQ(parcel.status, Status::kFailed);
  EXPECT_THAT(parcel.reason, HasSubstr("the arm would touch P7"));
  const Progress itself = run(kTrajectory, trajectory({{6.0, folded_onto_itself()}}));
  EXPECT_EQ(itself.status, Status::kFailed);
  EXPECT_THAT(itself.reason, ContainsRegex("the arm would touch [a-z0-9_]+_link and [a-z0-9_]+;"));
  EXPECT_EQ(cell_.arm.motion_end(), Time{}) << "nothing moved";
}

TEST_F(FollowTest, WhatStandsInTheWayIsNamed) {
  const Vector3 here = tip_now(), there = here + Vector3(0.36, 0, 0);
  const world::World changed = with_post(world_, here + Vector3(0.18, 0, 0));
  Cell own(end_, changed, model::RobotModel::load(changed.robot).value());
  own.refresh(now_, {});
  task::SkillRegistry registry;
  add_skills(registry, own, {});
  const Json through = path({{4.0, there}});
  const auto feasible = registry.find(kPath)->feasible(through, Moment::kAdmission);
  ASSERT_TRUE(feasible) << feasible.error().line();
  const auto skill = registry.find(kPath)->start(through, now_);
  Progress progress;
  for (int tick = 0; tick < 100 && !task::is_end(progress.status); ++tick) progress = skill->tick(now_);
  EXPECT_EQ(progress.status, Status::kFailed);
  EXPECT_THAT(progress.reason, HasSubstr(" and post"));
  const auto into = registry.find(kPath)->feasible(path({{2.0, here + Vector3(0.18, 0, 0)}}), Moment::kAdmission);
  ASSERT_FALSE(into);
  EXPECT_THAT(into.error().line(), HasSubstr("over point 1 the arm touches what stands there ("));
  const auto over = own.model.inverse(Cell::tip_down(here + Vector3(0.18, 0, 0), 0), changed.robot.home);
  ASSERT_TRUE(over);
  const auto joints = registry.find(kTrajectory)->feasible(trajectory({{2.0, *over}}), Moment::kAdmission);
  ASSERT_FALSE(joints);
  EXPECT_THAT(joints.error().line(), HasSubstr("at point 1 the arm touches what stands there ("));
}

// The arm swings about its base, past where it is free, into what stands between two of its points.
TEST_F(FollowTest, WhatStandsBetweenTwoPointsIsRefusedWithTheTaskWhereTheBeginIsGiven) {
  const AxisVector from = home(), over = home({{0, 0.5}}), to = home({{0, 1.0}});
  const world::World changed = with_post(world_, cell_.model.world_from_tip(over).translation());
  Cell own(end_, changed, model::RobotModel::load(changed.robot).value());
  own.refresh(now_, {});
  task::SkillRegistry registry;
  add_skills(registry, own, {});
  const auto says = [&](const Json& arguments, Moment moment) {
    const auto good = registry.find(kTrajectory)->feasible(arguments, moment);
    return good ? std::string() : good.error().line();
  };
  const Json through = trajectory({{0.0, from}, {1.0, home({{0, 0.1}})}, {5.0, to}});
  for (const Moment moment : {Moment::kAdmission, Moment::kStart}) {
    EXPECT_THAT(says(through, moment),
                AllOf(HasSubstr("between point 2 and point 3, "), HasSubstr("the arm touches what stands there ("),
                      HasSubstr(" and post); lead it around that")));
  }
  EXPECT_EQ(says(trajectory({{0.0, from}, {5.0, home({{0, -1.0}})}}), Moment::kAdmission), "") << "the other way";
  EXPECT_EQ(says(trajectory({{1.0, home({{0, 0.1}})}, {5.0, to}}), Moment::kAdmission), "")
      << "where it begins nobody knows, and how it passes the first point depends on that";
  // In its times it could not be gone; in others it would be another way.
  Json quick = trajectory({{0.0, from}, {0.1, home({{0, 0.1}})}, {0.8, to}});
  quick["goal_time_tolerance"] = 10;
  EXPECT_EQ(says(quick, Moment::kAdmission), "");
}

TEST_F(FollowTest, WhatComesInTheWayStopsItBeforeItIsTouched) {
  const Vector3 here = tip_now(), down(here.x(), 0, world_.belt.surface_z_m + 0.05);
  double lowest = here.z();
  const Progress end = run(kPath, path({{3.0, {here.x(), 0, here.z()}}, {6.0, down}}), [&](double t) {
    lowest = std::min(lowest, tip_now().z());
    if (t > 3.2 && seen_.empty()) sees("P9", {here.x(), 0, world_.belt.surface_z_m + 0.2});
  });
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_THAT(end.reason, HasSubstr("the arm would touch P9"));
  EXPECT_GT(lowest, world_.belt.surface_z_m + 0.2);
  EXPECT_GT(end.detail.at("progress").get<double>(), 0.5);
}

// ---- its end ----

TEST_F(FollowTest, AnArmThatIsNotWhereItShouldBeHasNotArrived) {
  Json arguments = trajectory({{1.0, home({{0, 0.3}})}});
  arguments["goal_tolerance"] = 0.02;
  for (const double off_rad : {0.015, 0.025}) {
    off_rad_ = off_rad;
    const Progress end = run(kTrajectory, arguments);
    if (off_rad < 0.02) {
      EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
    } else {
      EXPECT_EQ(end.status, Status::kFailed);
      EXPECT_THAT(end.reason, HasSubstr("goal_tolerance_violated: " + cell_.model.axis_names()[1] +
                                        " is 0.0250 rad off the last point, of which 0.0200 are allowed"));
    }
    EXPECT_NEAR(end.detail.at("worst_rad").get<double>(), off_rad, 1e-6);
    arguments = trajectory({{1.0, home()}});
    arguments["goal_tolerance"] = 0.02;
  }
}

// ---- the verbs ----

TEST_F(FollowTest, PausedItStandsOnTheWayAndGoesOnThroughTheRest) {
  const std::vector<std::pair<double, AxisVector>> points{
      {1.0, home({{0, 0.4}})}, {2.0, home({{0, 0.6}, {5, 0.5}})}, {3.0, home({{0, 0.1}})}};
  bool paused = false, resumed = false;
  Time told;
  double nearest_second = 10, nearest_first = 10;
  const Progress end = run(kTrajectory, trajectory(points), [&](double t) {
    if (t > 1.3 && !paused) skill_->pause(told = now_, task::Pause::kStand), paused = true;
    if (paused && !resumed && now_ > told + std::chrono::seconds(2)) {
      EXPECT_LT(cell_.arm.state().speed.norm(), 1e-9);
      skill_->resume(now_), resumed = true;
    }
    if (resumed) {
      nearest_second = std::min(nearest_second, off(points[1].second));
      nearest_first = std::min(nearest_first, off(points[0].second));
    }
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_LT(nearest_second, 0.02) << "still to come";
  EXPECT_GT(nearest_first, 0.05) << "passed before";
  EXPECT_GT(end.detail.at("took_s").get<double>(), 5.0);
  EXPECT_LT(off(points.back().second), 1e-6);
}

TEST_F(FollowTest, WhereAnotherHasHadTheArmItFirstGoesBack) {
  const Vector3 here = tip_now();
  bool paused = false, moved = false, resumed = false;
  Time told;
  AxisVector left;
  double back = 10;
  const Progress end = run(kPath, path({{2.0, here + Vector3(0.2, 0, 0)}, {4.0, here}}), [&](double t) {
    if (t > 1.0 && !std::exchange(paused, true)) skill_->pause(told = now_, task::Pause::kHandOver);
    if (paused && !moved && now_ > told + std::chrono::seconds(1)) {
      left = cell_.arm.state().position;
      const Time from = cell_.arm.splice_time(now_);
      const AxisVector away = left + home({{0, -1.5}}) - home();
      const auto way = motion::move(at_rest(left), from, {away, AxisVector::Zero(left.size())}, cell_.limits_planned());
      ASSERT_TRUE(way && cell_.arm.stream(*way));
      moved = true;
    }
    if (moved && !resumed && now_ > told + std::chrono::seconds(4)) {
      EXPECT_GT(off(left), 1.4);
      skill_->resume(now_), resumed = true;
    }
    if (resumed) back = std::min(back, off(left));
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_LT(back, 0.05);
  EXPECT_LT((tip_now() - here).norm(), 1e-4);
}

TEST_F(FollowTest, CancelledItStopsAndSaysHowFarItGot) {
  bool cancelled = false;
  const Progress end = run(kTrajectory, trajectory({{3.0, home({{0, 1.0}})}}), [&](double t) {
    if (t > 1.5 && !std::exchange(cancelled, true)) skill_->cancel(now_);
  });
  EXPECT_EQ(end.status, Status::kFailed);
  EXPECT_EQ(end.reason, "cancelled");
  EXPECT_LT(cell_.arm.state().speed.norm(), 1e-9);
  EXPECT_NEAR(end.detail.at("progress").get<double>(), 0.5, 0.05);
}

// ---- the tip's way ----

TEST_F(FollowTest, TheTipIsAtEachPlaceAtItsTimePointingDown) {
  const Vector3 here = tip_now();
  const std::vector<std::pair<double, Vector3>> points{
      {1.5, here + Vector3(0.2, 0, 0)}, {2.5, here + Vector3(0.2, 0.1, 0.05)}, {4.0, here + Vector3(-0.1, 0, 0)}};
  const Eigen::Matrix3d turned = cell_.model.world_from_tip(cell_.arm.state().position).linear();
  int met = 0;
  double tilt = 0;
  const Progress end = run(kPath, path(points), [&](double t) {
    for (const auto& [time_s, place] : points) {
      if (std::abs(t - time_s) > 0.006) continue;
      ++met;
      EXPECT_LT((tip_now() - place).norm(), 0.002) << time_s;
    }
    const Eigen::Matrix3d is = cell_.model.world_from_tip(cell_.arm.state().position).linear();
    tilt = std::max(tilt, std::abs(Eigen::AngleAxisd(is.transpose() * turned).angle()));
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_GE(met, 3);
  EXPECT_LT(tilt, 0.01);
}

// With two places the tip's way is straight, however the joints turn.
TEST_F(FollowTest, BetweenTwoPlacesTheTipGoesStraight) {
  const Vector3 from = tip_now(), to = from + Vector3(0.35, 0.05, 0.1);
  double beside = 0;
  const Progress end = run(kPath, path({{2.0, to}}), [&](double) {
    const Vector3 on = tip_now() - from, along = (to - from).normalized();
    beside = std::max(beside, (on - on.dot(along) * along).norm());
  });
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
  EXPECT_LT(beside, 0.001);
}

TEST_F(FollowTest, APathThatCannotBeGoneIsRefusedByName) {
  const Vector3 here = tip_now();
  EXPECT_EQ(refusal(kPath, path({{2, here}})), "");
  EXPECT_THAT(refusal(kPath, path({{2, here}, {4, {3, 0, 1}}})), HasSubstr("point 2 is out of reach"));
  EXPECT_THAT(refusal(kPath, path({{2, here}, {1, here}})), HasSubstr("point 2: 1 s is not at least"));
  const Progress quick = run(kPath, path({{0.2, here + Vector3(0.4, 0, 0)}}));
  EXPECT_EQ(quick.status, Status::kFailed);
  EXPECT_THAT(quick.reason, AllOf(HasSubstr("point 1: "), HasSubstr("times its"), HasSubstr("at the soonest")));
  const double quickest = std::stod(quick.reason.substr(quick.reason.find("after ") + 6));
  const Progress end = run(kPath, path({{quickest, here + Vector3(0.4, 0, 0)}}));
  EXPECT_EQ(end.status, Status::kSucceeded) << end.reason;
}

}  // namespace
}  // namespace pons::skills
