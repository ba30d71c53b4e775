// Paths round obstacles, in a cluttered parcel cell: how many of random pairs of postures are joined, with how many
// samples, in what time, and how long the paths are. Nothing here is a promise of real time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <numbers>
#include <vector>

#include "pons/core/random.hpp"
#include "pons/model/collision.hpp"
#include "pons/motion/path.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;

struct Options {
  std::string world = "parcel_cell";
  int pairs = 300, boxes = 8, iterations = 1000;
  std::uint64_t seed = 1;
  double least_percent = 0;  // solved, of the pairs that no straight line joins
};

// The floor, the belt, and posts of random size about the arm.
std::vector<model::Box> clutter(const world::World& world, int count, Random& random) {
  std::vector<model::Box> boxes(2);
  const world::Belt& belt = world.belt;
  boxes[0].size_m = {6, 6, 0.1};
  boxes[0].world_from_box.translation() = Vector3(0, 0, belt.surface_z_m - 0.1);
  boxes[1].size_m = {belt.x_end_m - belt.x_start_m, belt.width_m, 0.06};
  boxes[1].world_from_box.translation() =
      Vector3((belt.x_start_m + belt.x_end_m) / 2, belt.y_center_m, belt.surface_z_m - 0.03);
  const Vector3 base = world.robot.world_from_base.translation();
  for (int i = 0; i < count; ++i) {
    const double angle = random.uniform(-std::numbers::pi, std::numbers::pi), far_m = random.uniform(0.35, 0.85);
    model::Box box{.size_m = {random.uniform(0.05, 0.25), random.uniform(0.05, 0.25), random.uniform(0.2, 0.9)}};
    box.world_from_box = pose_xyz_yaw(base.x() + far_m * std::cos(angle), base.y() + far_m * std::sin(angle),
                                      belt.surface_z_m + 0.5 * box.size_m.z(), random.uniform(0, 3));
    boxes.push_back(box);
  }
  return boxes;
}

AxisVector draw_clear(const AxisLimits& limits, model::CollisionModel& model, Random& random) {
  AxisVector q(limits.position_min.size());
  do {
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      q[i] = random.uniform(std::max(limits.position_min[i], -std::numbers::pi),
                            std::min(limits.position_max[i], std::numbers::pi));
    }
  } while (!model.clear(q));
  return q;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void tell(const char* what, const std::vector<double>& values, const char* unit) {
  fmt::print("{:34} median {:9.3f}   90 % {:9.3f}   worst {:9.3f} {}\n", what, quantile(values, 0.5),
             quantile(values, 0.9), quantile(values, 1), unit);
}

int run(const Options& options) {
  const auto world = world::load("worlds", options.world);
  if (!world) return fmt::print(stderr, "{}\n", world.error().line()), 2;
  auto robot = model::RobotModel::load(world->robot);
  if (!robot) return fmt::print(stderr, "{}\n", robot.error().line()), 2;
  model::CollisionModel model(std::move(*robot), {.scene_m = 0.02, .self_m = 0.01, .load_m = 0.02});
  const motion::FreeSpace space{[&](const AxisVector& q) { return model.clear(q); },
                                [&](const AxisVector& a, const AxisVector& b) { return model.clear(a, b); }};
  Random random(options.seed);
  std::vector<double> samples, found, shortened, corners, took_ms, failed_ms;
  int straight = 0, touching = 0;
  for (int pair = 0; pair < options.pairs; ++pair) {
    model.surround(clutter(*world, options.boxes, random));
    const AxisVector start = draw_clear(world->robot.limits, model, random);
    const AxisVector goal = draw_clear(world->robot.limits, model, random);
    const auto begin = std::chrono::steady_clock::now();
    const auto path =
        motion::find_path(start, goal, world->robot.limits, space,
                          {.seed = options.seed + static_cast<std::uint64_t>(pair), .iterations = options.iterations});
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    if (!path) {
      failed_ms.push_back(ms);
      continue;
    }
    if (path->iterations == 0) {
      ++straight;
      continue;
    }
    // Every line once more, far finer than the search looked.
    for (std::size_t i = 0; i + 1 < path->points.size(); ++i) {
      for (int k = 0; k <= 200; ++k) {
        const AxisVector q = path->points[i] + k / 200.0 * (path->points[i + 1] - path->points[i]);
        if (model.clearance(q) < -0.5 * model::CollisionModel::kStep_m) ++touching;
      }
    }
    const double direct = (goal - start).norm();
    samples.push_back(path->iterations);
    found.push_back(path->found_rad / direct);
    shortened.push_back(motion::length_rad(path->points) / direct);
    corners.push_back(static_cast<double>(path->points.size()) - 2);
    took_ms.push_back(ms);
  }
  const int blocked = options.pairs - straight;
  const double solved_percent = 100.0 * static_cast<double>(samples.size()) / std::max(1, blocked);
  fmt::print("{}: {} pairs among {} posts, {} samples at most; {} straight, of the other {} solved {:.1f} %\n",
             options.world, options.pairs, options.boxes, options.iterations, straight, blocked, solved_percent);
  tell("samples", samples, "");
  tell("time, solved", took_ms, "ms");
  tell("time, not solved", failed_ms, "ms");
  tell("length over the straight line", found, "as found");
  tell("", shortened, "shortened");
  tell("corners", corners, "");
  fmt::print("postures of the paths nearer than margins less half a step: {}\n", touching);
  if (solved_percent < options.least_percent) fmt::print("too few: {:.0f} % are asked for\n", options.least_percent);
  return touching == 0 && solved_percent >= options.least_percent ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  CLI::App app{"Paths round obstacles in a cluttered cell"};
  app.add_option("--world", options.world);
  app.add_option("--pairs", options.pairs)->check(CLI::Range(1, 1'000'000));
  app.add_option("--boxes", options.boxes)->check(CLI::Range(0, 100));
  app.add_option("--iterations", options.iterations)->check(CLI::Range(1, 10'000'000));
  app.add_option("--seed", options.seed);
  app.add_option("--least", options.least_percent, "Fails where fewer are solved, %")->check(CLI::Range(0.0, 100.0));
  CLI11_PARSE(app, argc, argv);
  return run(options);
} catch (const std::exception& error) {
  fmt::print(stderr, "path_planning: {}\n", error.what());
  return 2;
}
