#include "pons/skills/route.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "pons/skills/test_kit.hpp"
#include "pons/world/view.hpp"

namespace pons::skills {
namespace {

using ::testing::HasSubstr;

constexpr double kToolSide_m = 0.08;  // cups and their holder, about the tip
const Time kBegin = Time(from_s(3));

class RouteTest : public ::testing::Test {
 protected:
  // Joint angles with the tool pointing down, its tip at (x, y, z).
  AxisVector over(double x, double y, double z) {
    Pose pose = pose_xyz_yaw(x, y, z, 0);
    pose.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
    const auto q = model_.inverse(pose, world_.robot.home);
    EXPECT_TRUE(q) << q.error().line();
    return q.value_or(world_.robot.home);
  }
  // With a tick of its own.
  Expected<motion::Trajectory> route(const AxisState& start, Time at, const motion::Waypoint& end, const Load* load,
                                     std::span<const ObjectBelief> obstacles, const AxisLimits& limits) {
    router_.refresh();
    return router_.route(start, at, end, load, obstacles, limits);
  }
  // With as many ticks as it takes, at least one.
  static Expected<motion::Trajectory> route_in(int& ticks, Router& router, const AxisState& start,
                                               const motion::Waypoint& end, const Load* load,
                                               const AxisLimits& limits) {
    std::optional<Passage> known;
    for (ticks = 1;; ++ticks) {
      router.refresh();
      auto way = router.route(start, kBegin, end, load, {}, limits, &known);
      EXPECT_LT(router.work(), 6000);
      if (way || !router.spent() || ticks == 100) return way;
    }
  }
  static AxisState rest(const AxisVector& q) { return {q, AxisVector::Zero(q.size()), AxisVector::Zero(q.size())}; }
  static motion::Waypoint halt(const AxisVector& q) { return {q, AxisVector::Zero(q.size())}; }

  // A parcel on the belt, its top's middle at (x, 0) when the motion begins.
  ObjectBelief parcel(double x, const Vector3& size_m, double speed_m_s = 0) const {
    ObjectBelief object;
    object.stamp = kBegin;
    object.world_from_top.translation() = Vector3(x, 0, world_.belt.surface_z_m + size_m.z());
    object.velocity_m_s.x() = speed_m_s;
    object.size_m = size_m;
    return object;
  }

  // How far the lowest part of tool (or of what hangs `depth_m` below it) stays above the top of `object` while it is
  // within the footprint; nothing if it never is.
  std::optional<double> clearance(const motion::Trajectory& way, const ObjectBelief& object, double side_m,
                                  double depth_m) {
    std::optional<double> least;
    for (Time time = way.front().start; time <= way.back().end(); time += std::chrono::milliseconds(4)) {
      const Pose world_from_tip = model_.world_from_tip(motion::sample(way, time, model_.axes()).position);
      const Vector3 top = object.world_from_top.translation() + to_s(time - object.stamp) * object.velocity_m_s;
      for (const double x : {-0.5, 0.5})
        for (const double y : {-0.5, 0.5}) {
          const Vector3 low = world_from_tip * Vector3(x * side_m, y * side_m, depth_m);
          const Vector3 off = (low - top).cwiseAbs();
          if (off.x() > 0.5 * object.size_m.x() || off.y() > 0.5 * object.size_m.y()) continue;
          least = std::min(least.value_or(std::numeric_limits<double>::infinity()), low.z() - top.z());
        }
    }
    return least;
  }

  // Likewise of the tool over the plane of a top that leans, wherever straight below the tool there is top.
  double rise_over(const motion::Trajectory& way, const ObjectBelief& object) {
    double least = std::numeric_limits<double>::infinity();
    const Vector3 up = object.world_from_top.linear().col(2);
    for (Time time = way.front().start; time <= way.back().end(); time += std::chrono::milliseconds(4)) {
      const Pose world_from_tip = model_.world_from_tip(motion::sample(way, time, model_.axes()).position);
      for (const double x : {-0.5, 0.5})
        for (const double y : {-0.5, 0.5}) {
          const Vector3 low = world_from_tip * Vector3(x * kToolSide_m, y * kToolSide_m, 0);
          const double height_m = up.dot(low - object.world_from_top.translation()) / up.z();
          const Vector3 off = object.world_from_top.inverse() * Vector3(low - height_m * Vector3::UnitZ());
          if (std::abs(off.x()) > 0.5 * object.size_m.x() || std::abs(off.y()) > 0.5 * object.size_m.y()) continue;
          least = std::min(least, height_m);
        }
    }
    return least;
  }

  void expect_leads(const Expected<motion::Trajectory>& way, const AxisVector& from, const AxisVector& to) {
    ASSERT_TRUE(way) << way.error().line();
    EXPECT_EQ(way->front().start, kBegin);
    EXPECT_TRUE(motion::sample(*way, kBegin, model_.axes()).position.isApprox(from, 1e-9));
    const AxisState end = motion::sample(*way, way->back().end(), model_.axes());
    EXPECT_TRUE(end.position.isApprox(to, 1e-7));
    EXPECT_TRUE(end.speed.isZero(1e-7));
    const motion::LimitUse use = motion::limit_use(*way, world_.robot.limits);
    EXPECT_TRUE(use.inside_position);
    EXPECT_LE(use.worst(), 1.0 + 1e-6);
  }

  const world::World world_ = parcel_cell();
  model::RobotModel model_ = model::RobotModel::load(world_.robot).value();
  Router router_{world_, model_.copy()};
  const AxisLimits& limits_ = world_.robot.limits;
};

TEST_F(RouteTest, ABareBeltIsCrossedDirectly) {
  const AxisVector from = over(-0.3, 0, 1.1), to = over(0.35, 0, 1.1);
  const auto way = route(rest(from), kBegin, halt(to), nullptr, {}, limits_);
  expect_leads(way, from, to);
  const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
  ASSERT_TRUE(direct);
  EXPECT_EQ(way->back().end(), direct->back().end());
}

TEST_F(RouteTest, AWayOverAnObstacleStaysClearOfIt) {
  const AxisVector from = over(-0.3, 0, 1.0), to = over(0.35, 0, 1.0);
  const std::array obstacles{parcel(0.02, {0.2, 0.2, 0.25})};
  const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
  ASSERT_TRUE(direct);
  ASSERT_LT(clearance(*direct, obstacles[0], kToolSide_m, 0).value(), 0) << "the direct way must be blocked";

  const auto way = route(rest(from), kBegin, halt(to), nullptr, obstacles, limits_);
  expect_leads(way, from, to);
  EXPECT_GT(clearance(*way, obstacles[0], kToolSide_m, 0).value(), 0.01);
  EXPECT_LT(to_s(way->back().end() - kBegin), 2.5) << "over it, not far around";
}

TEST_F(RouteTest, AMovingObstacleIsWhereItWillBe) {
  const AxisVector from = over(-0.3, 0, 1.0), to = over(0.35, 0, 1.0);
  const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
  ASSERT_TRUE(direct);
  // Seen upstream a second ago, in the middle of the way when the arm comes by.
  ObjectBelief arrives = parcel(-0.25, {0.16, 0.16, 0.25}, 0.22);
  arrives.stamp = kBegin - from_s(1);
  ASSERT_LT(clearance(*direct, arrives, kToolSide_m, 0).value(), 0);
  const auto way = route(rest(from), kBegin, halt(to), nullptr, std::array{arrives}, limits_);
  expect_leads(way, from, to);
  EXPECT_GT(clearance(*way, arrives, kToolSide_m, 0).value(), 0.01);
  // Seen in the middle of the way five seconds ago: gone.
  ObjectBelief gone = parcel(0.02, {0.16, 0.16, 0.25}, 0.22);
  gone.stamp = kBegin - from_s(5);
  const auto free = route(rest(from), kBegin, halt(to), nullptr, std::array{gone}, limits_);
  expect_leads(free, from, to);
  EXPECT_EQ(free->back().end(), direct->back().end());
}

TEST_F(RouteTest, WhatHangsOnTheCupsPassesHigher) {
  const AxisVector from = over(-0.3, 0, 1.2), to = over(0.35, 0, 1.2);
  const std::array obstacles{parcel(0.02, {0.16, 0.16, 0.18})};
  const Load load{.size_m = {0.16, 0.16, 0.2}};
  const auto empty = route(rest(from), kBegin, halt(to), nullptr, obstacles, limits_);
  ASSERT_TRUE(empty) << empty.error().line();
  ASSERT_LT(clearance(*empty, obstacles[0], 0.16, load.size_m.z()).value(), 0) << "the load would hit it on that way";
  const auto way = route(rest(from), kBegin, halt(to), &load, obstacles, limits_);
  expect_leads(way, from, to);
  EXPECT_GT(clearance(*way, obstacles[0], 0.16, load.size_m.z()).value(), 0.01);
}

// Its middle is low enough to pass over directly, its upper edge is not.
TEST_F(RouteTest, WhatLeansIsAsHighAsItsUpperEdge) {
  const AxisVector from = over(-0.35, 0, 1.09), to = over(0.4, 0, 1.09);
  const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
  ASSERT_TRUE(direct);
  const ObjectBelief level = parcel(0.02, {0.3, 0.2, 0.15});
  const auto over_level = route(rest(from), kBegin, halt(to), nullptr, std::array{level}, limits_);
  expect_leads(over_level, from, to);
  ASSERT_EQ(over_level->back().end(), direct->back().end()) << "level it is no obstacle";
  for (const double lean_rad : {-0.35, 0.35}) {
    ObjectBelief leaning = level;
    leaning.world_from_top.rotate(Eigen::AngleAxisd(lean_rad, Vector3::UnitY()));
    ASSERT_LT(rise_over(*direct, leaning), 0) << "the direct way must be blocked";
    const auto way = route(rest(from), kBegin, halt(to), nullptr, std::array{leaning}, limits_);
    expect_leads(way, from, to);
    ASSERT_TRUE(way);
    EXPECT_GT(rise_over(*way, leaning), 0.01);
  }
}

TEST_F(RouteTest, AWayIsFoundOverTheHighEdgeOfWhatLeansSteeply) {
  const AxisVector from = over(-0.35, 0, 1.1), to = over(0.4, 0, 1.1);
  ObjectBelief steep = parcel(0.02, {0.4, 0.2, 0.16});
  steep.world_from_top.rotate(Eigen::AngleAxisd(0.7, Vector3::UnitY()));
  const auto way = route(rest(from), kBegin, halt(to), nullptr, std::array{steep}, limits_);
  expect_leads(way, from, to);
  ASSERT_TRUE(way);
  EXPECT_GT(rise_over(*way, steep), 0.01);
}

TEST_F(RouteTest, WhoAsksAgainForNearlyTheSameSparesTheSearch) {
  const AxisVector from = over(-0.3, 0, 1.05), to = over(0.35, 0, 1.05);
  const std::array obstacles{parcel(0.02, {0.2, 0.2, 0.2})};
  std::optional<Passage> known;
  const auto first = router_.route(rest(from), kBegin, halt(to), nullptr, obstacles, limits_, &known);
  expect_leads(first, from, to);
  ASSERT_TRUE(known);
  const int searched = router_.work();
  router_.refresh();
  const auto again = router_.route(rest(from), kBegin, halt(to), nullptr, obstacles, limits_, &known);
  expect_leads(again, from, to);
  EXPECT_LT(3 * router_.work(), 2 * searched);
  EXPECT_LE(again->back().end(), first->back().end() + from_s(0.01));
  // Where that passage is no longer clear, another one is found.
  known = Passage{.higher_m = 0, .shares = {0.5}};
  const std::array taller{parcel(0.02, {0.2, 0.2, 0.3})};
  const auto other = route(rest(from), kBegin, halt(to), nullptr, taller, limits_);
  const auto told_wrongly = router_.route(rest(from), kBegin, halt(to), nullptr, taller, limits_, &known);
  expect_leads(told_wrongly, from, to);
  EXPECT_EQ(told_wrongly->back().end(), other->back().end());
}

// The bridge must show the loop that it lives, and motions must come in time.
TEST_F(RouteTest, ASearchEndsWithItsTick) {
  const AxisVector from = over(-0.3, 0, 1.05), to = over(0.35, 0, 1.05);
  const Load load{.size_m = {0.3, 0.3, 0.3}};
  std::vector<ObjectBelief> wall;
  for (int i = 0; i < 12; ++i) wall.push_back(parcel(-0.25 + 0.05 * i, {0.04, 0.5, 0.9}));
  for (int asked = 0; asked < 5; ++asked) {
    router_.refresh();
    const auto way = router_.route(rest(from), kBegin, halt(to), &load, wall, limits_);
    ASSERT_FALSE(way);
    EXPECT_THAT(way.error().line(), HasSubstr("no clear way"));
    for (int more = 0; more < 20; ++more)
      EXPECT_FALSE(router_.route(rest(from), kBegin, halt(to), &load, wall, limits_));
    EXPECT_TRUE(router_.spent());
    EXPECT_LT(router_.work(), 9000) << "postures judged";
  }
  expect_leads(route(rest(from), kBegin, halt(to), nullptr, {}, limits_), from, to);
}

// Lifted out from beside something tall, a load goes up before its corners swing.
TEST_F(RouteTest, ALoadDoesNotTurnIntoWhatStandsBesideIt) {
  const Load load{.size_m = {0.3, 0.12, 0.13}};
  const ObjectBelief tall = parcel(0.0, {0.3, 0.12, 0.2});  // a centimetre beside it
  const auto longer_s = [&](double z, double turn_rad) {
    const AxisVector from = over(0, 0.13, z);
    AxisVector to = over(0, 0.13, 1.3);
    to[5] += turn_rad;
    const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
    const auto way = route(rest(from), kBegin, halt(to), &load, std::array{tall}, limits_);
    EXPECT_TRUE(direct && way);
    return direct && way ? to_s(way->back().end() - direct->back().end()) : 0;
  };
  EXPECT_EQ(longer_s(1.05, 0), 0) << "straight up";
  EXPECT_GT(longer_s(1.05, 1.2), 0) << "up first";
  EXPECT_EQ(longer_s(1.27, 1.2), 0) << "above it";
}

// What comes along the belt where no camera has shown it yet may be as high as any parcel.
TEST_F(RouteTest, UpstreamOfWhatTheCamerasSeeALoadStaysHighOverTheBelt) {
  const Load load{.size_m = {0.4, 0.15, 0.1}};
  const auto clear = [&](double from_x, double to_x, double z) {
    const auto way = motion::move(rest(over(from_x, 0.1, z)), kBegin, halt(over(to_x, 0.1, z)), limits_);
    EXPECT_TRUE(way);
    return way && router_.clear(*way, kBegin, way->back().end() + from_s(1), &load, {});
  };
  EXPECT_TRUE(clear(-0.1, -0.35, 1.15));
  EXPECT_FALSE(clear(-0.4, -0.72, 1.15));
  EXPECT_FALSE(clear(-0.4, -0.72, 1.35)) << "0.35 m over the belt";
  EXPECT_TRUE(clear(-0.4, -0.72, 1.46));
}

// Where the tool comes down beside a tall neighbour the links above it may not, on one side of it at least.
TEST_F(RouteTest, TheWristKeepsOffATallNeighbour) {
  const AxisVector from = over(-0.3, -0.3, 1.3), to = over(0.1, 0, 1.02);
  AxisVector down = AxisVector::Zero(to.size());
  down[1] = 0.1;  // not at rest: it goes on, down on the parcel
  std::vector<model::PlacedCapsule> links;
  const auto wrist_over = [&](const AxisVector& q, const ObjectBelief& object) {
    double least = std::numeric_limits<double>::infinity();
    model_.place_capsules(q, links);
    for (std::size_t i = 0; i < links.size(); ++i) {
      if (world_.robot.capsules[i].link == world_.robot.flange_link) continue;
      for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
        const Vector3 at = links[i].from + share * (links[i].to - links[i].from);
        const Vector3 off = (at - object.world_from_top.translation()).cwiseAbs();
        const double side_m = 0.5 * object.size_m.x() + links[i].radius_m;
        if (off.x() > side_m || off.y() > side_m) continue;
        least = std::min(least, at.z() - links[i].radius_m - object.world_from_top.translation().z());
      }
    }
    return least;
  };
  int blocked = 0, clear = 0;
  for (const Vector3& side : {Vector3(1, 0, 0), Vector3(-1, 0, 0), Vector3(0, 1, 0), Vector3(0, -1, 0)}) {
    ObjectBelief tall = parcel(0.1 + 0.28 * side.x(), {0.24, 0.24, 0.36});
    tall.world_from_top.translation().y() = 0.28 * side.y();
    const auto way = route(rest(from), kBegin, {to, down}, nullptr, std::array{tall}, limits_);
    if (wrist_over(to, tall) < 0.02) {
      ++blocked;
      EXPECT_FALSE(way) << side.transpose();
    } else if (way) {
      ++clear;
      for (Time time = kBegin; time <= way->back().end(); time += std::chrono::milliseconds(4)) {
        EXPECT_GT(wrist_over(motion::sample(*way, time, model_.axes()).position, tall), 0) << side.transpose();
      }
    }
  }
  EXPECT_GE(blocked, 1);
  EXPECT_GE(clear, 1);
}

TEST_F(RouteTest, WhatIsBelievedLaterMayStandInTheWay) {
  const AxisVector from = over(-0.4, 0, 1.0), to = over(0.4, 0, 1.0);
  const auto way = route(rest(from), kBegin, halt(to), nullptr, {}, limits_);
  ASSERT_TRUE(way);
  const Time end = way->back().end(), half = kBegin + (end - kBegin) / 2;
  const ObjectBelief ahead = parcel(0.2, {0.1, 0.1, 0.2}), behind = parcel(-0.2, {0.1, 0.1, 0.2});
  EXPECT_TRUE(router_.clear(*way, kBegin, end, nullptr, {}));
  EXPECT_FALSE(router_.clear(*way, kBegin, end, nullptr, std::array{behind}));
  EXPECT_TRUE(router_.clear(*way, half, end, nullptr, std::array{behind}));
  EXPECT_FALSE(router_.clear(*way, half, end, nullptr, std::array{ahead}));
}

TEST_F(RouteTest, TheArmDoesNotFoldOntoItsLoad) {
  const AxisVector high = over(-0.22, -0.14, 1.64);
  const Load large{.size_m = {0.34, 0.31, 0.28}}, small{.size_m = {0.10, 0.08, 0.05}};
  const Time end = kBegin + from_s(0.1);
  EXPECT_TRUE(router_.clear_at(high, kBegin, end, nullptr, {}));
  EXPECT_TRUE(router_.clear_at(high, kBegin, end, &small, {}));
  EXPECT_FALSE(router_.clear_at(high, kBegin, end, &large, {}));
  EXPECT_TRUE(router_.clear_at(over(-0.22, -0.14, 1.3), kBegin, end, &large, {}));
}

// As large as a load gets, it is put back as low over the belt as a small one.
TEST_F(RouteTest, ALargeLoadReachesTheBelt) {
  const Load load{.size_m = {0.40, 0.34, 0.18}};
  const AxisVector from = over(0.35, 0.05, 1.28), to = over(0.2, 0, world_.belt.surface_z_m + 0.18 + 0.03);
  expect_leads(route(rest(from), kBegin, halt(to), &load, {}, limits_), from, to);
}

// Lifted no higher than it has to be, it lingers while the next one comes along; what stood close to it may stay so.
TEST_F(RouteTest, WhatComesAlongDoesNotRideIntoALoad) {
  const Load load{.size_m = {0.34, 0.32, 0.15}};
  const AxisVector from = over(0.2, 0, 1.15), to = over(0.24, 0.03, 1.15);
  AxisLimits slow = limits_;
  slow.speed_rad_s *= 0.02;
  const auto way = motion::move(rest(from), kBegin, halt(to), slow);
  ASSERT_TRUE(way);
  const Time end = way->back().end();
  const Vector3 size_m(0.34, 0.32, 0.25);
  const ObjectBelief next = parcel(0.2 - 0.34 - 0.12, size_m, 0.25), close = parcel(0.2 - 0.34 - 0.01, size_m, 0);
  ASSERT_LT(clearance(*way, next, 0.32, 0.15).value_or(1), 0) << "it must ride into it";
  EXPECT_FALSE(router_.clear(*way, kBegin, end, &load, std::array{next}));
  EXPECT_TRUE(router_.clear(*way, kBegin, end, &load, std::array{close}));
}

TEST_F(RouteTest, OverRimsAndBeltOnTheWayToAChute) {
  const world::Place* chute = world_.place("chute_3");
  ASSERT_NE(chute, nullptr);
  const AxisVector from = over(0.1, 0.05, 0.95);
  const AxisVector to = over(chute->center_m.x(), chute->center_m.y(), 1.0);
  const auto way = route(rest(from), kBegin, halt(to), nullptr, {}, limits_);
  expect_leads(way, from, to);
  for (Time time = kBegin; time <= way->back().end(); time += std::chrono::milliseconds(4)) {
    const Vector3 tip = model_.world_from_tip(motion::sample(*way, time, model_.axes()).position).translation();
    EXPECT_GT(tip.z(), world_.belt.surface_z_m) << "at " << tip.transpose();
  }
}

TEST_F(RouteTest, AnEndBeyondALimitIsNamed) {
  const AxisVector from = over(-0.3, 0, 1.1);
  AxisVector to = from;
  to[2] = world_.robot.limits.position_max[2] + 0.1;
  const auto way = route(rest(from), kBegin, halt(to), nullptr, {}, limits_);
  ASSERT_FALSE(way);
  EXPECT_THAT(way.error().line(), HasSubstr("limit"));
}

TEST_F(RouteTest, NoWayThroughAWallIsNamed) {
  const AxisVector from = over(-0.3, 0, 1.0), to = over(0.35, 0, 1.0);
  const std::array obstacles{parcel(0.02, {0.3, 0.3, 1.2})};
  const auto way = route(rest(from), kBegin, halt(to), nullptr, obstacles, limits_);
  ASSERT_FALSE(way);
  EXPECT_FALSE(way.error().what.empty());
  EXPECT_FALSE(way.error().where.empty());
  EXPECT_FALSE(way.error().mend.empty());
}

// Too tall to go over: the way leads round it, and what the collision model says of it holds at every moment.
TEST_F(RouteTest, ATallPostIsGoneRound) {
  world::World world = parcel_cell();
  world.places.push_back({"post", world::PlaceKind::kObstacle, {0.02, 0.08, 1.15}, {0.06, 0.06, 0.5}});
  Router router(world, model_.copy());
  model::CollisionModel collision(model_.copy(), {.self_m = 0.0, .load_m = 0.0});
  collision.surround(standing(world));
  const Load load{.size_m = {0.12, 0.1, 0.08}};
  const auto touches = [&](const motion::Trajectory& way, const Load* carries) {
    collision.carry(carried(carries));
    for (Time time = way.front().start; time <= way.back().end(); time += std::chrono::milliseconds(4)) {
      if (collision.clearance(motion::sample(way, time, model_.axes()).position) < 0.01) return true;
    }
    return false;
  };
  for (const Load* const carries : {static_cast<const Load*>(nullptr), &load}) {
    const AxisVector from = over(-0.3, 0.05, 1.12), to = over(0.35, 0.05, 1.12);
    const auto direct = motion::move(rest(from), kBegin, halt(to), limits_);
    ASSERT_TRUE(direct);
    ASSERT_TRUE(touches(*direct, carries)) << "the direct way must be blocked";
    int ticks = 0;
    const auto way = route_in(ticks, router, rest(from), halt(to), carries, limits_);
    expect_leads(way, from, to);
    ASSERT_TRUE(way);
    EXPECT_FALSE(touches(*way, carries));
    const auto again = route_in(ticks, router, rest(from), halt(to), carries, limits_);
    ASSERT_TRUE(again);
    EXPECT_EQ(again->back().end(), way->back().end());
  }
}

TEST_F(RouteTest, LimitsCoverWhatTheArmAlreadyDoes) {
  AxisState start = rest(world_.robot.home);
  start.acceleration[1] = -8;
  start.speed[2] = 2;
  AxisLimits gentle = limits_;
  gentle.acceleration_rad_s2 *= 0.1;
  gentle.speed_rad_s *= 0.5;
  const AxisLimits wider = covering(gentle, start);
  EXPECT_GE(wider.acceleration_rad_s2[1], 8);
  EXPECT_GE(wider.speed_rad_s[2], 2);
  EXPECT_EQ(wider.acceleration_rad_s2[0], gentle.acceleration_rad_s2[0]);
  EXPECT_EQ(wider.speed_rad_s[0], gentle.speed_rad_s[0]);
  EXPECT_EQ(wider.jerk_rad_s3, gentle.jerk_rad_s3);

  start.speed[1] = -gentle.speed_rad_s[1];
  const AxisVector end = start.position + AxisVector::Constant(start.position.size(), 0.4);
  EXPECT_TRUE(motion::move(start, kBegin, halt(end), covering(gentle, start)));
}

// Samples cost too much for one tick to draw them all.
TEST_F(RouteTest, AWayRoundIsSearchedForFromTickToTick) {
  world::World world = parcel_cell();
  world.places.push_back({"mast", world::PlaceKind::kObstacle, {-0.5, -0.75, 0.75}, {0.08, 0.08, 1.5}});
  Router router(world, model_.copy());
  const Load load{.size_m = {0.34, 0.22, 0.19}};
  const world::Place* chute = world.place("chute_8");
  const AxisVector from = over(-0.3, 0.05, 1.3), to = over(chute->center_m.x(), chute->center_m.y(), 1.1);
  int ticks = 0;
  expect_leads(route_in(ticks, router, rest(from), halt(to), &load, limits_), from, to);
  EXPECT_LT(ticks, 60);
  int again = 0;
  expect_leads(route_in(again, router, rest(from), halt(to), &load, limits_), from, to);
  EXPECT_LT(again + 5, ticks) << "found once, it is known for a while";
}

// A fence before the chutes that nothing passes.
TEST_F(RouteTest, WhatNoWayLeadsPastIsNamed) {
  world::World world = parcel_cell();
  world.places.push_back({"fence", world::PlaceKind::kObstacle, {0, -0.62, 1.3}, {4, 0.04, 2.6}});
  Router router(world, model_.copy());
  const world::Place* chute = world.place("chute_8");
  int ticks = 0;
  const auto way = route_in(ticks, router, rest(world.robot.home),
                            halt(over(chute->center_m.x(), chute->center_m.y(), 1.1)), nullptr, limits_);
  ASSERT_FALSE(way);
  EXPECT_THAT(way.error().line(), testing::HasSubstr("fence"));
}

}  // namespace
}  // namespace pons::skills
