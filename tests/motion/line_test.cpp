#include "pons/motion/line.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/world/world.hpp"

namespace pons::motion {
namespace {

using ::testing::HasSubstr;

constexpr Time kAt{std::chrono::milliseconds(250)};
constexpr double kDegree = std::numbers::pi / 180;

class LineTest : public ::testing::TestWithParam<const char*> {
 protected:
  // Off the line from its ends, sampled each millisecond: the worst way and angle. Where there is no way to go the
  // angle is that to the nearest orientation of the turn.
  struct Off {
    double way_m = 0, turn_rad = 0;
  };
  Off off(const Trajectory& way, const Pose& from, const Pose& to) {
    const Eigen::Quaterniond first(from.linear());
    Eigen::Quaterniond last(to.linear());
    if (first.dot(last) < 0) last.coeffs() = -last.coeffs();
    const Vector3 whole = to.translation() - from.translation();
    Off worst;
    for (Time time = way.front().start; time <= way.back().end(); time += std::chrono::milliseconds(1)) {
      const Pose tip = model_.world_from_tip(sample(way, time, model_.axes()).position);
      const Vector3 gone = tip.translation() - from.translation();
      const Eigen::Quaterniond turned(tip.linear());
      const double share = whole.norm() > 1e-3
                               ? std::clamp(gone.dot(whole) / whole.squaredNorm(), 0.0, 1.0)
                               : nearest_share([&](double t) { return first.slerp(t, last).angularDistance(turned); });
      worst.way_m = std::max(worst.way_m, (gone - share * whole).norm());
      worst.turn_rad = std::max(worst.turn_rad, first.slerp(share, last).angularDistance(turned));
    }
    return worst;
  }
  // Where in [0, 1] a distance with one minimum has it, by the golden section.
  static double nearest_share(const std::function<double(double)>& distance) {
    double low = 0, high = 1;
    for (int i = 0; i < 40; ++i) {
      const double a = high - 0.618 * (high - low), b = low + 0.618 * (high - low);
      (distance(a) < distance(b) ? high : low) = distance(a) < distance(b) ? b : a;
    }
    return (low + high) / 2;
  }
  void expect_good(const Line& line, const AxisVector& start, const Pose& goal) {
    const Trajectory& way = line.trajectory;
    ASSERT_FALSE(way.empty());
    EXPECT_EQ(way.front().start, kAt);
    EXPECT_LE(way.size(), 250U) << "more than the control loop holds";
    const LimitUse use = limit_use(way, limits_);
    EXPECT_LE(use.worst(), 1 + 1e-9);
    EXPECT_TRUE(use.inside_position);
    const Off worst = off(way, model_.world_from_tip(start), goal);
    EXPECT_LE(worst.way_m, 1e-4);
    EXPECT_LE(worst.turn_rad, 0.01 * kDegree);
    const AxisState begin = sample(way, kAt, model_.axes()), end = sample(way, way.back().end(), model_.axes());
    EXPECT_LT((begin.position - start).cwiseAbs().maxCoeff(), 1e-9);
    const Pose tip = model_.world_from_tip(end.position);
    EXPECT_LT((tip.translation() - goal.translation()).norm(), 1e-6);
    EXPECT_LT(end.speed.cwiseAbs().maxCoeff(), 1e-9);
    expect_smooth(way);
    EXPECT_GE(to_s(way.back().end() - kAt), line.least_s);
  }
  void expect_smooth(const Trajectory& way) {
    AxisState before = sample(way, kAt, model_.axes()), after = before;
    for (std::size_t k = 0; k + 1 < way.size(); ++k) {
      pons::sample(way[k], way[k].end(), before);
      pons::sample(way[k + 1], way[k + 1].start, after);
      ASSERT_EQ(way[k].end(), way[k + 1].start);
      ASSERT_LT((before.position - after.position).cwiseAbs().maxCoeff(), 1e-9) << k;
      ASSERT_LT((before.speed - after.speed).cwiseAbs().maxCoeff(), 1e-7) << k;
      ASSERT_LT((before.acceleration - after.acceleration).cwiseAbs().maxCoeff(), 1e-5) << k;
    }
  }
  // The tip's greatest speed and turning speed on the way.
  std::pair<double, double> tip_speeds(const Trajectory& way) {
    std::pair<double, double> most{0, 0};
    for (Time time = kAt; time <= way.back().end(); time += std::chrono::milliseconds(1)) {
      const AxisState state = sample(way, time, model_.axes());
      const Eigen::Matrix<double, 6, 1> twist = model_.tip_jacobian(state.position) * state.speed;
      most = {std::max(most.first, twist.head<3>().norm()), std::max(most.second, twist.tail<3>().norm())};
    }
    return most;
  }

  AxisVector near_home(Random& random, double range_rad) {
    AxisVector q = world_.robot.home;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      q[i] = std::clamp(q[i] + random.uniform(-range_rad, range_rad), limits_.position_min[i] + 0.1,
                        limits_.position_max[i] - 0.1);
    }
    return q;
  }

  const world::World world_ = world::load("worlds", GetParam()).value();
  model::RobotModel model_ = model::RobotModel::load(world_.robot).value();
  const AxisLimits& limits_ = world_.robot.limits;
};

TEST_P(LineTest, RandomLinesAreKeptWithinAllLimitsAndNotMuchSlowerThanTheyMustBe) {
  Random random(1);
  const TipLimits tip;
  int planned = 0;
  std::vector<double> over;
  for (int i = 0; i < 60 && !HasFailure(); ++i) {
    SCOPED_TRACE(i);
    const AxisVector start = near_home(random, 0.5);
    Pose goal = model_.world_from_tip(start);
    goal.translation() += Vector3(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-0.2, 0.2));
    const Vector3 axis(random.normal(), random.normal(), random.normal());
    goal.linear() = Eigen::AngleAxisd(random.uniform(-0.8, 0.8), axis.normalized()) * goal.linear();
    const auto line = move_line(model_, start, kAt, goal, limits_, tip);
    if (!line) {
      EXPECT_THAT(line.error().line(), ::testing::AnyOf(HasSubstr("reach"), HasSubstr("singularity")));
      continue;
    }
    ++planned;
    expect_good(*line, start, goal);
    const auto [speed, turning] = tip_speeds(line->trajectory);
    EXPECT_LE(speed, 1.002 * tip.speed_m_s);
    EXPECT_LE(turning, 1.002 * tip.turn_rad_s);
    over.push_back(to_s(line->trajectory.back().end() - kAt) / line->least_s);
  }
  EXPECT_GE(planned, 40);
  std::ranges::sort(over);
  std::printf("%s: %d of 60 lines, duration over the bound: median %.3f, worst %.3f\n", GetParam(), planned,
              over[over.size() / 2], over.back());
  EXPECT_LT(over[over.size() / 2], 1.8);
}

TEST_P(LineTest, ATurnOfTheToolAloneKeepsItsPlaceAndItsAxis) {
  Random random(6);
  int planned = 0;
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const AxisVector start = near_home(random, 0.3);
    Pose goal = model_.world_from_tip(start);
    goal.rotate(Eigen::AngleAxisd(random.uniform(-3, 3), Vector3(random.normal(), random.normal(), 1).normalized()));
    const auto line = move_line(model_, start, kAt, goal, limits_, {});
    if (!line) continue;
    ++planned;
    expect_good(*line, start, goal);
    const Pose end =
        model_.world_from_tip(sample(line->trajectory, line->trajectory.back().end(), model_.axes()).position);
    EXPECT_LT((end.linear() - goal.linear()).norm(), 1e-6);
  }
  EXPECT_GE(planned, 10);
}

// What a line costs is counted, so that the slowest is refused on any computer alike: with one pose less than it needs.
TEST_P(LineTest, ALineCostsNoMorePosesThanItMay) {
  Random random(7);
  int planned = 0;
  for (int i = 0; i < 10; ++i) {
    SCOPED_TRACE(i);
    const AxisVector start = near_home(random, 0.3);
    Pose goal = model_.world_from_tip(start);
    goal.translation() += Vector3(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.1, 0.1));
    const auto line = move_line(model_, start, kAt, goal, limits_, {});
    if (!line) continue;
    ++planned;
    const int pieces = static_cast<int>(line->trajectory.size());
    EXPECT_LE(line->poses, kMostPoses);
    EXPECT_GE(line->poses, 64 + 200 + 2 * pieces) << "followed, sampled, fitted and looked at";
    const auto again = move_line(model_, start, kAt, goal, limits_, {}, line->poses);
    ASSERT_TRUE(again) << again.error().line();
    EXPECT_EQ(again->poses, line->poses);
    for (const int fewer : {1, pieces + 1, line->poses - 100, line->poses - 1}) {
      const auto less = move_line(model_, start, kAt, goal, limits_, {}, line->poses - fewer);
      ASSERT_FALSE(less) << fewer;
      EXPECT_THAT(less.error().line(), ::testing::StartsWith("line: takes more than " +
                                                             std::to_string(line->poses - fewer) + " poses to plan"));
    }
  }
  EXPECT_GE(planned, 5);
}

TEST_P(LineTest, NowhereToGoIsNoMotion) {
  const AxisVector start = world_.robot.home;
  const auto line = move_line(model_, start, kAt, model_.world_from_tip(start), limits_, {});
  ASSERT_TRUE(line) << line.error().line();
  EXPECT_LE(to_s(line->trajectory.back().end() - kAt), 1e-6);
}

TEST_P(LineTest, SaysWhatIsWrong) {
  const AxisVector start = world_.robot.home;
  const auto error = [&](const AxisVector& from, const Pose& goal, const TipLimits& tip) {
    const auto line = move_line(model_, from, kAt, goal, limits_, tip);
    return line ? std::string("none") : line.error().line();
  };
  Pose far = model_.world_from_tip(start);
  far.translation() += Vector3(0.2, 3, 0);
  EXPECT_THAT(error(start, far, {}), ::testing::AllOf(HasSubstr("leaves the arm's reach"), HasSubstr("% of the line")));
  Pose broken = model_.world_from_tip(start);
  broken.translation().x() = std::nan("");
  EXPECT_THAT(error(start, broken, {}), HasSubstr("not finite"));
  EXPECT_THAT(error(AxisVector::Zero(3), far, {}), HasSubstr("another number of axes"));
  EXPECT_THAT(error(start, far, {.jerk_m_s3 = 0}), HasSubstr("limit of the tip"));
  Pose near = model_.world_from_tip(start);
  near.translation().z() += 0.05;
  EXPECT_EQ(error(start, near, {}), "none");
  EXPECT_THAT(error(start, near, {.speed_m_s = 0.01}),
              HasSubstr("would take more than the 4.7 s that can be followed"));
}

INSTANTIATE_TEST_SUITE_P(Worlds, LineTest, ::testing::Values("parcel_cell", "small_cell"));

// Through and past the three singularities of a six-axis arm.
class SingularLineTest : public LineTest {
 protected:
  // Of a singular posture's tool pose, `aside_m` beside it, from `half_m` before to `half_m` behind along `along`.
  Expected<Line> past(const AxisVector& singular, const Vector3& along, const Vector3& across, double aside_m,
                      double half_m) {
    Pose pose = model_.world_from_tip(singular);
    const Vector3 middle = pose.translation() + aside_m * across;
    pose.translation() = middle - half_m * along;
    const auto start = model_.inverse(pose, singular, model::Among::kAllBranches);
    if (!start) return fail("no start");
    goal_ = pose;
    goal_.translation() = middle + half_m * along;
    start_ = *start;
    return move_line(model_, *start, kAt, goal_, limits_, {});
  }
  AxisVector start_;
  Pose goal_;
};

TEST_P(SingularLineTest, NeverJumpsAndNeverBreaksALimit) {
  // Of the hanging arm at home: the wrist straight; the elbow stretched; the wrist's middle under axis 1.
  AxisVector wrist = world_.robot.home, elbow = wrist, shoulder = wrist;
  wrist[4] = 0;
  elbow[2] = 0;
  // Axis 2 turned until the wrist's centre comes under axis 1.
  const Vector3 base = world_.robot.world_from_base.translation();
  double least = 1;
  for (double lean = -2.5; lean < 2.5; lean += 1e-4) {
    AxisVector q = world_.robot.home;
    q[1] += lean;
    const double side = std::abs(model_.branch(q).shoulder == model_.branch(world_.robot.home).shoulder ? 1.0 : 0.0);
    if (side < least) least = side, shoulder = q;
  }
  ASSERT_EQ(least, 0) << "the shoulder's singularity must be found from " << base.transpose();
  int through = 0, refused = 0, jumps = 0, past_at_1cm = 0, all_at_1cm = 0;
  Random random(3);
  for (const AxisVector& singular : {wrist, elbow, shoulder}) {
    for (int i = 0; i < 8; ++i) {
      const Vector3 along = Vector3(random.normal(), random.normal(), 0.3 * random.normal()).normalized();
      const Vector3 across = along.cross(Vector3(random.normal(), random.normal(), random.normal())).normalized();
      for (const double aside_m : {0.0, 1e-4, 1e-3, 1e-2, 3e-2}) {
        SCOPED_TRACE(::testing::Message() << singular.transpose() << ", " << i << ", " << aside_m);
        const auto line = past(singular, along, across, aside_m, 0.1);
        if (aside_m >= 1e-2) ++all_at_1cm;
        if (line) {
          expect_good(*line, start_, goal_);
          ++through;
          if (aside_m >= 1e-2) ++past_at_1cm;
        } else {
          ++refused;
          jumps += line.error().what.find("would have to jump") != std::string::npos ? 1 : 0;
          EXPECT_THAT(line.error().line(), ::testing::AnyOf(HasSubstr("reach"), HasSubstr("singularity"),
                                                            HasSubstr("no start"), HasSubstr("limit")));
        }
      }
    }
  }
  std::printf("past singularities: %d good, %d refused; at 1 cm and more %d of %d\n", through, refused, past_at_1cm,
              all_at_1cm);
  EXPECT_GT(through, 20);
  EXPECT_GT(refused, 20);
  EXPECT_GT(jumps, 5);
  EXPECT_GE(past_at_1cm, all_at_1cm / 3);
}

// Straight through the pose at which the wrist is straight.
TEST_P(SingularLineTest, ThroughAStraightWristIsRefusedByName) {
  AxisVector wrist = world_.robot.home;
  wrist[4] = 0;
  // Across the plane in which the straight wrist can still move the tool.
  const model::Jacobian jacobian = model_.tip_jacobian(wrist);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian, Eigen::ComputeFullU);
  const Vector3 lost = svd.matrixU().col(5).head<3>();
  const auto line = past(wrist, lost.normalized(), Vector3::Zero(), 0, 0.1);
  ASSERT_FALSE(line);
  EXPECT_THAT(line.error().line(), HasSubstr("singularity"));
}

INSTANTIATE_TEST_SUITE_P(Worlds, SingularLineTest, ::testing::Values("parcel_cell"));

// The same of any arm, whatever its singularities are: they are looked for downhill.
class AnySingularLineTest : public SingularLineTest {
 protected:
  Eigen::JacobiSVD<Eigen::MatrixXd> decomposed(const AxisVector& q) {
    return Eigen::JacobiSVD<Eigen::MatrixXd>(Eigen::MatrixXd(model_.tip_jacobian(q)), Eigen::ComputeFullU);
  }
  double least(const AxisVector& q) { return decomposed(q).singularValues()[5]; }
  // Where the Jacobian's least singular value is next to nothing, well inside the position limits.
  AxisVector singular_from(AxisVector q, Random& random) {
    double now = least(q);
    for (int i = 0; i < 4000 && now > 1e-5; ++i) {
      AxisVector next = q;
      for (Eigen::Index axis = 0; axis < q.size(); ++axis) {
        next[axis] = std::clamp(q[axis] + std::min(0.05, now) * random.normal(), limits_.position_min[axis] + 0.1,
                                limits_.position_max[axis] - 0.1);
      }
      if (const double there = least(next); there < now) now = there, q = next;
    }
    return q;
  }
};

TEST_P(AnySingularLineTest, NeverJumpsAndNeverBreaksALimit) {
  Random random(4);
  int found = 0, through = 0, refused = 0, jumps = 0;
  for (int i = 0; i < 20; ++i) {
    const AxisVector singular = singular_from(near_home(random, 0.8), random);
    if (least(singular) > 1e-4) continue;
    ++found;
    const Vector3 lost = decomposed(singular).matrixU().col(5).head<3>();
    const Vector3 any = Vector3(random.normal(), random.normal(), random.normal()).normalized();
    for (const Vector3& along : {Vector3(lost.norm() > 1e-3 ? lost.normalized() : any), any}) {
      const Vector3 across = along.cross(Vector3(random.normal(), random.normal(), random.normal())).normalized();
      for (const double aside_m : {0.0, 1e-3, 1e-2, 3e-2}) {
        SCOPED_TRACE(::testing::Message() << singular.transpose() << ", " << i << ", " << aside_m);
        const auto line = past(singular, along, across, aside_m, 0.1);
        ++(line ? through : refused);
        if (line) {
          expect_good(*line, start_, goal_);
          continue;
        }
        jumps += line.error().what.find("would have to jump") != std::string::npos ? 1 : 0;
        EXPECT_THAT(line.error().line(), ::testing::AnyOf(HasSubstr("reach"), HasSubstr("singularity"),
                                                          HasSubstr("no start"), HasSubstr("limit")));
      }
    }
  }
  std::printf("%s: %d singular postures; %d good, %d refused, %d of them jumps\n", GetParam(), found, through, refused,
              jumps);
  EXPECT_GE(found, 10);
  EXPECT_GE(through, 8);
  EXPECT_GT(jumps, 10);
}

INSTANTIATE_TEST_SUITE_P(Worlds, AnySingularLineTest, ::testing::Values("parcel_cell", "small_cell"));

}  // namespace
}  // namespace pons::motion
