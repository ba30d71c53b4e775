// What planning straight lines of the tool costs, which the bridge does within one tick: at random, half of them past
// a singularity at a distance of nothing to 3 cm. Nothing here is a promise of real time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/line.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;

struct Options {
  std::string world = "parcel_cell";
  int lines = 2000;
  std::uint64_t seed = 1;
};

struct Ends {
  AxisVector start;
  Pose world_from_goal;
};

Vector3 any_direction(Random& random) {
  return Vector3(random.normal(), random.normal(), random.normal()).normalized();
}

AxisVector any_posture(const AxisLimits& limits, Random& random) {
  AxisVector q(limits.position_min.size());
  for (Eigen::Index i = 0; i < q.size(); ++i)
    q[i] = random.uniform(std::max(-3.0, limits.position_min[i]), std::min(3.0, limits.position_max[i]));
  return q;
}

double least_gain(model::RobotModel& model, const AxisVector& q) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(model.tip_jacobian(q)).singularValues()[5];
}

// A random walk down to where the tip can hardly be moved in some direction.
AxisVector singular_posture(model::RobotModel& model, const AxisLimits& limits, Random& random) {
  AxisVector q = any_posture(limits, random);
  double gain = least_gain(model, q);
  for (int i = 0; i < 300 && gain > 1e-4; ++i) {
    AxisVector tried = q;
    for (auto& angle : tried) angle += random.normal() * 0.05 * std::min(1.0, 5 * gain);
    tried = tried.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
    if (const double there = least_gain(model, tried); there < gain) gain = there, q = tried;
  }
  return q;
}

Ends anywhere(model::RobotModel& model, const AxisLimits& limits, Random& random) {
  Ends ends{any_posture(limits, random), {}};
  ends.world_from_goal = model.world_from_tip(ends.start);
  ends.world_from_goal.translation() += random.uniform(0.05, 1) * any_direction(random);
  ends.world_from_goal.rotate(Eigen::AngleAxisd(random.uniform(-2, 2), any_direction(random)));
  return ends;
}

std::optional<Ends> past_a_singularity(model::RobotModel& model, const AxisLimits& limits, Random& random) {
  const AxisVector q = singular_posture(model, limits, random);
  const Vector3 along = any_direction(random), across = along.cross(any_direction(random)).normalized();
  const double asides_m[] = {0, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2};
  Pose from = model.world_from_tip(q);
  from.translation() += asides_m[random.below(6)] * across;
  Pose to = from;
  from.translation() -= random.uniform(0.02, 0.3) * along;
  to.translation() += random.uniform(0.02, 0.3) * along;
  const auto start = model.inverse(from, q, model::Among::kAllBranches);
  if (!start) return std::nullopt;
  return Ends{*start, to};
}

void tell(const char* what, std::vector<std::pair<double, int>> costs) {
  if (costs.empty()) return;
  std::ranges::sort(costs);
  int poses = 0;
  for (const auto& cost : costs) poses = std::max(poses, cost.second);
  fmt::print("{:8} {:5}   median {:6.2f} ms   99 % {:6.2f} ms   worst {:6.2f} ms, {} poses\n", what, costs.size(),
             costs[costs.size() / 2].first, costs[costs.size() * 99 / 100].first, costs.back().first, poses);
}

int run(const Options& options) {
  const auto world = world::load("worlds", options.world);
  if (!world) throw std::runtime_error(world.error().line());
  auto model = model::RobotModel::load(world->robot);
  if (!model) throw std::runtime_error(model.error().line());
  const AxisLimits& limits = world->robot.limits;
  Random random(options.seed);
  std::vector<std::pair<double, int>> planned, refused;
  while (std::ssize(planned) + std::ssize(refused) < options.lines) {
    const bool singular = (planned.size() + refused.size()) % 2 == 1;
    const auto ends = singular ? past_a_singularity(*model, limits, random) : anywhere(*model, limits, random);
    if (!ends) continue;
    const auto began = std::chrono::steady_clock::now();
    const auto line = motion::move_line(*model, ends->start, Time{}, ends->world_from_goal, limits, {});
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
    (line ? planned : refused).emplace_back(ms, line ? line->poses : 0);
  }
  fmt::print("{}, {} lines\n", options.world, options.lines);
  tell("planned", planned);
  tell("refused", refused);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app{"Straight lines of the tool, planned"};
    app.add_option("--world", options.world, "whose arm");
    app.add_option("--lines", options.lines, "how many")->check(CLI::PositiveNumber);
    app.add_option("--seed", options.seed, "of the lines");
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "line_planning: {}\n", error.what());
    return 2;
  }
}
