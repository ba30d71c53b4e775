#include "pons/skills/base/steer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace pons::skills {
namespace {

using ::testing::HasSubstr;

world::World rounds() {
  auto world = world::load("worlds", "rounds");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

class OnTheFloor : public ::testing::Test {
 protected:
  // The whole search at once.
  [[nodiscard]] Expected<Way> way(const Vector2& from, const Vector2& to) {
    WaySearch search(floor_, from, to);
    for (;;) {
      if (auto found = search.go_on(1000)) return *found;
    }
  }
  void see(std::vector<Vector2> unmapped, Time at = Time(std::chrono::seconds(1))) {
    BaseBelief belief;
    belief.stamp = at;
    belief.unmapped = std::move(unmapped);
    floor_.see(belief);
  }
  // A thing as wide as that, across the way at x.
  void see_bar(double x, double from_y, double to_y) {
    std::vector<Vector2> ends;
    for (double y = from_y; y <= to_y; y += 0.02) ends.emplace_back(x, y);
    see(std::move(ends));
  }

  const world::World world_ = rounds();
  const AxisLimits& limits_ = world_.robot.limits;
  Floor floor_{*world_.map, *world_.base};
};

TEST_F(OnTheFloor, AWayKeepsItsRoomAndIsNoLongerThanNeedBe) {
  const auto found = way({0, 0}, {4.5, 2.2});
  ASSERT_TRUE(found) << found.error().line();
  double length_m = 0;
  for (std::size_t i = 1; i < found->size(); ++i) {
    length_m += ((*found)[i] - (*found)[i - 1]).norm();
    EXPECT_GE(clearance_along(floor_, (*found)[i - 1], (*found)[i]), floor_.wanted_m() - 0.01);
  }
  EXPECT_LT(length_m, 1.06 * std::hypot(4.5, 2.2)) << "nearly straight";
  EXPECT_LE(found->size(), 5U) << "few corners";
  EXPECT_EQ(found->front(), Vector2(0, 0));
  EXPECT_EQ(found->back(), Vector2(4.5, 2.2));
}

TEST_F(OnTheFloor, WhatWasSeenIsGoneRoundAndForgottenLater) {
  const auto straight = way({0, 0}, {5.6, 0});
  ASSERT_TRUE(straight);
  see_bar(2.0, -0.5, 0.5);
  const auto round = way({0, 0}, {5.6, 0});
  ASSERT_TRUE(round);
  double farthest_m = 0;
  for (const Vector2& corner : *round) farthest_m = std::max(farthest_m, std::abs(corner.y()));
  EXPECT_GT(farthest_m, 0.7);
  const std::uint64_t version = floor_.version();
  floor_.forget_until(Time(std::chrono::seconds(10)));
  EXPECT_EQ(floor_.version(), version);
  floor_.forget_until(Time(std::chrono::seconds(400)));
  EXPECT_GT(floor_.version(), version);
  EXPECT_EQ(way({0, 0}, {5.6, 0}).value(), *straight);
}

TEST_F(OnTheFloor, WhatALookGoesThroughIsGone) {
  see({{1.5, 0.5}, {2.5, 0.5}});
  EXPECT_LT(floor_.clearance_m(Vector2(1.5, 0.5)), 0.05);
  BaseBelief look;
  look.stamp = Time(std::chrono::seconds(2));
  look.eye = {0, 0.525};
  look.ends = {{2.0, 0.525}, {1.4, 0.9}};  // through the nearer one, and short of the other
  floor_.see(look);
  EXPECT_GT(floor_.clearance_m(Vector2(1.5, 0.5)), 0.3);
  EXPECT_LT(floor_.clearance_m(Vector2(2.5, 0.5)), 0.05);
}

TEST_F(OnTheFloor, WhatWasFeltIsThereThoughALookGoesThrough) {
  const Time felt(std::chrono::seconds(1));
  floor_.feel({{1.5, 0.5}, {100, 100}}, felt);
  EXPECT_EQ(floor_.version(), 1U);
  EXPECT_LT(floor_.clearance_m(Vector2(1.5, 0.5)), 0.05);
  BaseBelief look;
  look.stamp = Time(std::chrono::seconds(2));
  look.eye = {0, 0.525};
  look.ends = {{2.0, 0.525}};
  floor_.see(look);
  EXPECT_LT(floor_.clearance_m(Vector2(1.5, 0.5)), 0.05);
  floor_.forget_until(felt + std::chrono::minutes(5));
  EXPECT_GT(floor_.clearance_m(Vector2(1.5, 0.5)), 0.3);
}

TEST_F(OnTheFloor, SaysWhyThereIsNoWay) {
  EXPECT_THAT(way({0, 0}, {4.5, 1.2}).error().line(), HasSubstr("the map has no room"));
  EXPECT_THAT(way({0, 0}, {40, 1.2}).error().line(), HasSubstr("the map has no room"));
  see({{1.5, 0.5}});
  EXPECT_THAT(way({0, 0}, {1.5, 0.5}).error().line(), HasSubstr("something that the map does not show stands at"));
  see_bar(5.0, -0.9, 0.9);
  see_bar(6.2, -0.9, 0.9);
  EXPECT_THAT(way({0, 0}, {5.6, 0}).error().line(), HasSubstr("there is no way to (5.60, 0.00)"));
}

// Drives in thought for as long as it takes, with a new look every tenth of a second.
class Driven : public OnTheFloor {
 protected:
  struct End {
    Pose2 pose;
    double took_s = 0, least_room_m = 1, fastest_m_s = 0;
    bool arrived = false;
  };
  End drive(const Pose2& from, Way way, double end_yaw) {
    const model::DiffDrive kinematics(*world_.base);
    Steer steer(floor_, *world_.base, limits_);
    steer.follow(std::move(way), end_yaw);
    Rolling now{from, at_rest(AxisVector::Zero(2))};
    End end;
    Time at;
    for (int look = 0; look < 1200 && !end.arrived; ++look) {
      const auto steered = steer.look_ahead(now, at);
      if (!steered) break;
      const motion::LimitUse use = motion::limit_use(steered->wheels, limits_);
      EXPECT_LE(use.worst(), 1 + 1e-6);
      const AxisState rest = motion::sample(steered->wheels, steered->wheels.back().end(), 2);
      EXPECT_LT(rest.speed.cwiseAbs().maxCoeff(), 1e-6) << "every look ends at rest";
      end.arrived = steered->arrives && steered->wheels.back().end() - at < std::chrono::milliseconds(150);
      for (int i = 0; i < 10; ++i) {
        at += std::chrono::milliseconds(10);
        const AxisState next = motion::sample(steered->wheels, at, 2);
        now.map_from_base = kinematics.rolled(now.map_from_base, now.wheels.position, next.position);
        now.wheels = next;
        end.least_room_m = std::min(end.least_room_m, floor_.clearance_m(now.map_from_base.position()));
        end.fastest_m_s = std::max(end.fastest_m_s, std::abs(kinematics.twist(next.speed).ahead));
      }
    }
    end.pose = now.map_from_base;
    end.took_s = at.s();
    return end;
  }
};

TEST_F(Driven, ArrivesOnAnyWay) {
  struct Case {
    Pose2 from, to;
  };
  for (const auto& [from, to] :
       {Case{{0, 0, 0}, {1.5, 0.5, 0}}, Case{{0, 0, 3.1}, {1.5, 0.5, -1.5}}, Case{{0, 0, 0}, {5.6, 0, 3.1}},
        Case{{5.6, 0, 1.5}, {4.5, 2.2, 0}}, Case{{0, 0, 0}, {0.03, -0.02, 0.1}}, Case{{0, 0, 0}, {-0.15, 0, 0}}}) {
    const auto found = way(from.position(), to.position());
    ASSERT_TRUE(found) << found.error().line();
    const End end = drive(from, *found, to.yaw);
    EXPECT_TRUE(end.arrived) << to.x << ", " << to.y;
    EXPECT_LT((end.pose.position() - to.position()).norm(), 0.025);
    EXPECT_LT(std::abs(wrapped(end.pose.yaw - to.yaw)), 0.01);
    EXPECT_GE(end.least_room_m, floor_.needed_m() - 1e-3);
    EXPECT_LE(end.fastest_m_s, world_.base->speed_m_s);
  }
}

TEST_F(Driven, IsAsFastAsItMayBeWhereThereIsRoom) {
  const End end = drive({0, 0, 0}, {{0, 0}, {1.9, 0}}, 0);
  EXPECT_TRUE(end.arrived);
  EXPECT_GT(end.fastest_m_s, 0.47);
  EXPECT_LT(end.took_s, 9);
}

TEST_F(Driven, StopsBeforeWhatStandsOnItsWay) {
  see_bar(1.5, -0.4, 0.4);
  const End end = drive({0, 0, 0}, {{0, 0}, {3, 0}}, 0);
  EXPECT_FALSE(end.arrived);
  EXPECT_GE(end.least_room_m, floor_.needed_m() - 1e-3);
  EXPECT_GT(end.pose.x, 0.8);
}

TEST_F(OnTheFloor, HowMuchOfAWayIsLeft) {
  const Way bent{{0, 0}, {2, 0}, {2, 1}};
  EXPECT_DOUBLE_EQ(left_along(bent, {0, 0}), 3);
  EXPECT_DOUBLE_EQ(left_along(bent, {1.5, -0.1}), 0.1 + 1.5);
  EXPECT_DOUBLE_EQ(left_along(bent, {2, 0.75}), 0.25);
  EXPECT_DOUBLE_EQ(left_along(bent, {2, 1}), 0);
  EXPECT_DOUBLE_EQ(left_along({{1, 1}, {1, 1}}, {0, 1}), 1);
}

}  // namespace
}  // namespace pons::skills
