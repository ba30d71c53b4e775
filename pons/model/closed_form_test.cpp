// The closed forms against forward kinematics by Pinocchio, on arms with every structure they know.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <utility>

#include "pons/core/random.hpp"
#include "pons/core/test_allocations.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/model/test_arms.hpp"
#include "pons/model/test_robots.hpp"

namespace pons::model {
namespace {

using Method = RobotModel::InverseMethod;
constexpr double kPi = std::numbers::pi;

const world::TestFolder folder;

struct Case {
  const char* name;
  Method method;
  std::vector<JointRow> rows;
};

// Each what another part of the solver is for, its axes drawn as they happen to point.
const Vector3 kX = Vector3::UnitX(), kY = Vector3::UnitY(), kZ = Vector3::UnitZ(), kNone = Vector3::Zero();
const Vector3 kSkew = Vector3(0.2, 1, 0.1).normalized();

// A link to the next axis.
JointRow row(double x, double y, double z, const Vector3& axis) { return {{x, y, z}, kNone, axis}; }

std::vector<Case> spherical_wrists() {
  const auto wrist = [](const Vector3& fourth, const Vector3& fifth, const Vector3& sixth, std::vector<JointRow> rows,
                        const Vector3& centre) {
    rows.insert(rows.end(), {{centre, kNone, fourth}, row(0, 0, 0, fifth), row(0, 0, 0, sixth)});
    return rows;
  };
  const JointRow base = row(0, 0, 0.4, kZ);
  std::vector<Case> cases;
  const auto add = [&](const char* name, const std::vector<JointRow>& rows) {
    cases.push_back({name, Method::kSphericalWrist, rows});
  };
  add("industrial", wrist(kX, kY, kX, {base, row(0.15, 0.02, 0, kY), row(0, 0.03, 0.6, kY)}, {0.6, -0.05, 0.12}));
  add("puma", wrist(kZ, kY, kZ, {base, row(0, 0.15, 0, kY), row(0.43, 0, 0, -kY)}, {0.02, 0, 0.43}));
  add("no_offset", wrist(kZ, kY, kZ, {base, row(0, 0, 0, kY), row(0, 0, 0.5, kY)}, {0, 0, 0.4}));
  add("skew_wrist", wrist(kZ, kSkew, kX, {base, row(0.1, 0, 0, kY), row(0, 0, 0.5, kY)}, {0, 0, 0.4}));
  add("shoulder_meets", wrist(kX, kY, kX, {base, row(0, 0, 0, kY), row(0.5, 0, 0.1, kZ)}, {0.4, 0, 0}));
  add("first_two_parallel", wrist(kX, kY, kX, {base, row(0.4, 0, 0, kZ), row(0.3, 0, 0, kY)}, {0.35, 0, 0}));
  add("pieper", wrist(kX, kY, kX, {base, row(0.1, 0.05, 0, kSkew), row(0.4, 0.1, 0.1, kZ)}, {0.35, 0.05, 0.1}));
  return cases;
}

std::vector<Case> cases() {
  const auto three = Method::kThreeParallelAxes;
  const JointRow base = row(0, 0, 0.2, kZ), along = row(0, 0, 0.4, kY);
  std::vector<Case> cases = spherical_wrists();
  cases.push_back({"ur_like",
                   three,
                   {base, row(0, 0.1, 0, kY), row(0, 0, 0.4, -kY), row(0.05, 0.02, 0.4, kY), row(0, 0.1, 0, kZ),
                    row(0, 0, 0.1, kY)}});
  cases.push_back(
      {"offset_first", three, {base, row(0.12, 0.1, 0, kY), along, along, row(0.06, 0.1, 0, kZ), row(0, 0, 0.1, kX)}});
  cases.push_back({"five_beside_six",
                   three,
                   {base, row(0.05, 0.1, 0, kY), along, along, row(0, 0.1, 0, kZ), row(0.07, 0, 0.1, kY)}});
  cases.push_back({"skew_first",
                   three,
                   {row(0, 0, 0.2, Vector3(0.3, 0.2, 1).normalized()), row(0.05, 0.1, 0, kY), along, along,
                    row(0.03, 0.1, 0, kSkew.cross(kX)), row(0.04, 0, 0.1, kY)}});
  return cases;
}

AxisVector anywhere(Random& random, double span) {
  AxisVector q(6);
  for (auto& angle : q) angle = random.uniform(-span, span);
  return q;
}

double error(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

// How far two joint vectors are apart, whole turns aside.
double apart(const AxisVector& a, const AxisVector& b) {
  double worst = 0;
  for (Eigen::Index i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(std::remainder(a[i] - b[i], 2 * kPi)));
  return worst;
}

struct Found {
  double worst_error = 0;
  int poses = 0, without_generator = 0, solutions = 0, most = 0;
};

// Every solution reaches, no two are the same, and the joints the pose was made from are among them.
Found check_all(RobotModel& model, int poses, std::uint64_t seed) {
  Random random(seed);
  Found result;
  BranchSolutions found;
  for (; result.poses < poses; ++result.poses) {
    const AxisVector q = anywhere(random, kPi);
    const Pose target = model.world_from_tip(q);
    model.inverse_all(target, q, found);
    double nearest = INFINITY;
    for (std::size_t i = 0; i < found.size(); ++i) {
      result.worst_error = std::max(result.worst_error, error(model.world_from_tip(found[i].q), target));
      nearest = std::min(nearest, apart(found[i].q, q));
    }
    // Near a singularity the same pose has the joints less exactly.
    if (!(nearest < 1e-5)) ++result.without_generator;
    result.solutions += static_cast<int>(found.size());
    result.most = std::max(result.most, static_cast<int>(found.size()));
  }
  return result;
}

TEST(ClosedForm, FindsAllOfAHundredThousandPosesOfTheHangingArm) {
  auto model = RobotModel::load(hanging_arm()).value();
  ASSERT_EQ(model.inverse_method(), Method::kThreeParallelAxes);
  const Found found = check_all(model, 100'000, 21);
  std::printf("worst error %.1e, %.2f solutions a pose, most %d\n", found.worst_error, 1e-5 * found.solutions,
              found.most);
  EXPECT_LT(found.worst_error, 1e-9);
  EXPECT_EQ(found.without_generator, 0);
  EXPECT_EQ(found.most, 8);
}

TEST(ClosedForm, FindsAllPosesOfEveryStructure) {
  for (const Case& one : cases()) {
    auto robot = serial_robot(folder, one.name, one.rows, {0.05, 0.02, 0.1}, kPi);
    robot.world_from_base = pose_xyz_yaw(0.3, -0.2, 0.5, 0.7);
    auto model = RobotModel::load(robot).value();
    ASSERT_EQ(model.inverse_method(), one.method) << one.name;
    const Found found = check_all(model, 10'000, 22);
    std::printf("%-20s worst error %.1e, %.2f solutions a pose, most %d\n", one.name, found.worst_error,
                1e-4 * found.solutions, found.most);
    EXPECT_LT(found.worst_error, 1e-9) << one.name;
    EXPECT_EQ(found.without_generator, 0) << one.name;
    EXPECT_LE(found.most, 8) << one.name;
  }
}

TEST(ClosedForm, BranchesOfAPoseDiffer) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(23);
  BranchSolutions found;
  for (int i = 0; i < 1000; ++i) {
    const AxisVector q = anywhere(random, kPi);
    model.inverse_all(model.world_from_tip(q), q, found);
    int own = 0;
    for (std::size_t a = 0; a < found.size(); ++a) {
      EXPECT_EQ(found[a].branch, model.branch(found[a].q));
      if (found[a].branch == model.branch(q)) ++own;
      for (std::size_t b = 0; b < a; ++b) EXPECT_FALSE(found[a].branch == found[b].branch);
    }
    EXPECT_EQ(own, 1);
  }
}

// Angles written with four decimals put the axes 4e-6 rad off: close enough to start from, and made up for.
TEST(ClosedForm, AxesThatAreNearlyParallelAreSolvedAsExactly) {
  const double quarter = 1.5708;
  const auto robot = serial_robot(folder, "rounded",
                                  {{{0, 0, 0.1625}},
                                   {kNone, {quarter, 0, 0}},
                                   {{-0.425, 0, 0}},
                                   {{-0.3922, 0, 0.1333}, {-quarter, 0, 0}, kY},
                                   {{0, -0.0997, 0}, {quarter, 0, 0}, kY},
                                   {{0, 0.0996, 0}, {-quarter, 0, 0}, kY}},
                                  {0, 0, 0.1}, kPi);
  auto model = RobotModel::load(robot).value();
  ASSERT_EQ(model.inverse_method(), Method::kThreeParallelAxes);
  const Found found = check_all(model, 10'000, 30);
  EXPECT_LT(found.worst_error, 1e-6);
  EXPECT_LE(found.without_generator, 10);
  std::printf("worst error %.1e, %d poses without their own joints\n", found.worst_error, found.without_generator);
}

// Wrist straight, elbow straight, both, the wrist folded back on axis 2, and over axis 1 where the arm allows that.
TEST(ClosedForm, SingularPosesHaveASolutionNearTheSeed) {
  std::vector<world::Robot> robots{hanging_arm()};
  for (const Case& one : cases()) {
    if (std::string_view(one.name) == "no_offset" || std::string_view(one.name) == "industrial")
      robots.push_back(serial_robot(folder, one.name, one.rows, {0, 0, 0.1}, 2 * kPi));
  }
  for (const auto& robot : robots) {
    auto model = RobotModel::load(robot).value();
    Random random(24);
    for (int i = 0; i < 3000; ++i) {
      AxisVector q = anywhere(random, 2);
      if (i % 3 != 0) q[4] = 0;
      if (i % 3 != 1) q[2] = 0;
      if (i % 7 == 0) q[1] = 0;
      if (i % 11 == 0) q[3] = 0;
      AxisVector seed = q;
      for (auto& angle : seed) angle += random.uniform(-0.02, 0.02);
      const Pose target = model.world_from_tip(q);
      for (const AxisVector& from : {q, seed}) {
        const auto found = model.inverse(target, from, Among::kAllBranches);
        ASSERT_TRUE(found) << robot.name << ' ' << q.transpose();
        EXPECT_LT(error(model.world_from_tip(*found), target), 1e-7) << robot.name << ' ' << q.transpose();
        EXPECT_LT((*found - from).norm(), 0.5) << robot.name << ' ' << q.transpose();
      }
    }
  }
}

TEST(ClosedForm, OutOfReachHasNoSolution) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(25);
  BranchSolutions found;
  for (int i = 0; i < 1000; ++i) {
    Pose target = model.world_from_tip(anywhere(random, kPi));
    target.translation() = hanging_arm().world_from_base.translation() +
                           Vector3(random.normal(), random.normal(), random.normal()).normalized() * 1.6;
    model.inverse_all(target, hanging_arm().home, found);
    EXPECT_TRUE(found.empty());
    EXPECT_FALSE(model.inverse(target, hanging_arm().home, Among::kAllBranches));
  }
  model.inverse_all(Pose(Eigen::Translation3d(NAN, 0, 0)), hanging_arm().home, found);
  EXPECT_TRUE(found.empty());
}

// A pose keeps the solutions that narrower limits leave, and no other; what is left is the nearest, in its nearest
// turn.
TEST(ClosedForm, LimitsAndTurnsAreKept) {
  auto robot = hanging_arm();
  auto wide = RobotModel::load(robot).value();
  robot.limits.position_min = axis_vector({-2.8, -3.0, -2.6, -4.0, -2.1, -5.0});
  robot.limits.position_max = axis_vector({2.8, 0.5, 2.6, 4.0, 2.1, 6.0});
  auto narrow = RobotModel::load(robot).value();
  const auto& limits = robot.limits;
  const auto fits = [&](const AxisVector& q) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      bool any = false;
      for (int turn = -2; turn <= 2; ++turn) {
        const double angle = q[i] + turn * 2 * kPi;
        any = any || (angle >= limits.position_min[i] && angle <= limits.position_max[i]);
      }
      if (!any) return false;
    }
    return true;
  };
  Random random(26);
  BranchSolutions all, left;
  for (int i = 0; i < 5000; ++i) {
    const AxisVector q = anywhere(random, kPi), seed = anywhere(random, 2 * kPi);
    const Pose target = wide.world_from_tip(q);
    wide.inverse_all(target, seed, all);
    narrow.inverse_all(target, seed, left);
    std::size_t fitting = 0;
    double nearest = INFINITY;
    for (const auto& solution : all) fitting += fits(solution.q) ? 1U : 0U;
    EXPECT_EQ(left.size(), fitting);
    for (const auto& solution : left) {
      for (Eigen::Index axis = 0; axis < 6; ++axis) {
        const double angle = solution.q[axis];
        EXPECT_TRUE(angle >= limits.position_min[axis] && angle <= limits.position_max[axis]);
        for (const double other : {angle - 2 * kPi, angle + 2 * kPi}) {
          if (other < limits.position_min[axis] || other > limits.position_max[axis]) continue;
          EXPECT_LE(std::abs(angle - seed[axis]), std::abs(other - seed[axis]) + 1e-9);
        }
      }
      nearest = std::min(nearest, (solution.q - seed).norm());
    }
    const auto chosen = narrow.inverse(target, seed, Among::kAllBranches);
    ASSERT_EQ(chosen.has_value(), fitting > 0);
    if (chosen) {
      EXPECT_NEAR((*chosen - seed).norm(), nearest, 1e-9);
    }
  }
}

// Along a path that stays clear of singularities each solution follows from the one before: the same branch, and as
// near as the path's own step.
TEST(ClosedForm, APathKeepsItsBranch) {
  for (const Case& one : cases()) {
    auto model = RobotModel::load(serial_robot(folder, one.name, one.rows, {0.05, 0.02, 0.1}, 2 * kPi)).value();
    Random random(27);
    int walked = 0;
    for (int path = 0; path < 200; ++path) {
      const AxisVector start = anywhere(random, 2), along = anywhere(random, 0.8);
      const Branch branch = model.branch(start);
      AxisVector seed = start;
      for (double t = 0; t <= 1; t += 0.02) {
        const AxisVector q = start + t * along;
        const auto determinant = [&](const AxisVector& at) {
          return Eigen::Matrix<double, 6, 6>(model.tip_jacobian(at)).determinant();
        };
        if (model.branch(q) != branch || std::abs(determinant(q)) < 0.1 * std::abs(determinant(start))) break;
        const auto found = model.inverse(model.world_from_tip(q), seed);
        ASSERT_TRUE(found) << one.name;
        ASSERT_LT((*found - q).cwiseAbs().maxCoeff(), 1e-6) << one.name << " path " << path << " at " << t;
        seed = *found;
        ++walked;
      }
    }
    EXPECT_GT(walked, 1000) << one.name;
  }
}

TEST(ClosedForm, TheSeedsBranchIsKeptOrRefused) {
  auto model = RobotModel::load(hanging_arm()).value();
  Random random(28);
  int kept = 0, refused = 0;
  for (int i = 0; i < 5000; ++i) {
    const AxisVector q = anywhere(random, kPi), seed = anywhere(random, kPi);
    const Pose target = model.world_from_tip(q);
    const auto found = model.inverse(target, seed);
    ++(found ? kept : refused);
    EXPECT_TRUE(!found || model.branch(*found) == model.branch(seed));
    EXPECT_TRUE(found || model.branch(q) != model.branch(seed));
  }
  EXPECT_GT(kept, 1000);
  EXPECT_GT(refused, 100);
}

TEST(ClosedForm, InverseAllocatesNothing) {
  const auto hanging = hanging_arm();
  const auto cases_here = cases();
  const auto& rows = cases_here.front().rows;
  const auto skewed = serial_robot(folder, "seven_rows",
                                   {rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], {{0.1, 0, 0.1}, {1, 0, 0}}},
                                   {0, 0, 0.1}, kPi);
  for (const auto& robot : {hanging, skewed}) {
    auto model = RobotModel::load(robot).value();
    Random random(29);
    BranchSolutions all;
    std::uint64_t worst = 0;
    int solved = 0;
    for (int i = 0; i < 500; ++i) {
      AxisVector q = robot.home;
      for (auto& angle : q) angle = random.uniform(-2, 2);
      AxisVector seed = q;
      seed.array() += 0.1;
      const Pose target = model.world_from_tip(q);
      bool near = false, any = false;
      const std::uint64_t allocations = test_allocations::allocations_in([&] {
        near = model.inverse(target, seed).has_value();
        any = model.inverse(target, seed, Among::kAllBranches).has_value();
        model.inverse_all(target, seed, all);
      });
      if (!near || !any) continue;  // the text of an error may allocate
      ++solved;
      worst = std::max(worst, allocations);
    }
    EXPECT_EQ(worst, 0) << robot.name;
    EXPECT_GT(solved, 250) << robot.name;
  }
}

}  // namespace
}  // namespace pons::model
