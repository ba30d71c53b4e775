#include "pons/skills/scenery.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pons/world/view.hpp"

namespace pons::skills {
namespace {

constexpr double kFront_m = 0.05;  // of what comes into view, so much must show
constexpr double kAround_m = 3;    // farther out than any arm reaches
constexpr double kRise_m = 0.05;
constexpr int kRises = 8;

// Between two corners, along the world's axes.
model::Box between(const Vector3& low, const Vector3& high) {
  model::Box box{.size_m = (high - low).cwiseMax(1e-3)};
  box.world_from_box.translation() = 0.5 * (low + high);
  return box;
}

// Wherever it rides: what leans is as high as its highest edge, and everything below it is taken.
model::Box swept(const ObjectBelief& object, double floor_z, Time from, Time until, double grow_m) {
  const Eigen::Matrix3d& axes = object.world_from_top.linear();
  const Vector3 half = 0.5 * object.size_m;
  const Vector3 reach = axes.leftCols<2>().cwiseAbs() * half.head<2>() + Vector3(grow_m, grow_m, 0);
  const Vector3 first = object.world_from_top.translation() + to_s(from - object.stamp) * object.velocity_m_s;
  const Vector3 last = object.world_from_top.translation() + to_s(until - object.stamp) * object.velocity_m_s;
  Vector3 low = first.cwiseMin(last) - reach, high = first.cwiseMax(last) + reach;
  low.z() = std::min(floor_z, high.z());
  return between(low, high);
}

}  // namespace

double unseen_end_m(const world::World& world) {
  double end_m = std::numeric_limits<double>::infinity();
  for (const world::CameraSpec& camera : world.cameras) {
    const auto seen = world::seen_of_belt(camera, world.belt);
    const double unseen_s = camera.period_s + camera.latency_s;
    if (seen) end_m = std::min(end_m, seen->from_m + kFront_m + unseen_s * world.belt.speed_m_s);
  }
  return std::isfinite(end_m) ? end_m : world.belt.x_start_m;
}

double rims_z_m(const world::World& world) {
  double highest = 0;
  for (const world::Place& place : world.places) {
    if (place.kind == world::PlaceKind::kChute) highest = std::max(highest, place.center_m.z());
  }
  return highest;
}

std::optional<model::CarriedBox> carried(const Load* load) {
  if (load == nullptr) return {};
  model::CarriedBox box{.size_m = load->size_m};
  box.size_m.z() += kSwing_rad * 0.5 * load->size_m.head<2>().norm();
  box.tip_from_box.translate(load->offset_in_tip_m);
  box.tip_from_box.rotate(Eigen::AngleAxisd(load->yaw_in_tip_rad, Vector3::UnitZ()));
  box.tip_from_box.translate(Vector3(0, 0, 0.5 * box.size_m.z()));
  return box;
}

std::vector<model::Box> standing(const world::World& world) {
  std::vector<model::Box> boxes;
  for (const world::Place& place : world.places) {
    if (place.kind != world::PlaceKind::kObstacle) continue;
    boxes.push_back(between(place.center_m - 0.5 * place.size_m, place.center_m + 0.5 * place.size_m));
  }
  return boxes;
}

std::optional<AxisVector> lifted(model::RobotModel& model, model::CollisionModel& judge, const AxisVector& q) {
  if (judge.clear(q)) return q;
  Pose pose = model.world_from_tip(q);
  for (int step = 0; step < kRises; ++step) {
    pose.translation().z() += kRise_m;
    auto higher = model.inverse(pose, q);
    if (!higher) break;
    if (judge.clear(*higher)) return *std::move(higher);
  }
  return {};
}

std::string named(const world::World& world, std::string touching, std::string_view other) {
  constexpr std::string_view kBox = "box ";
  const std::size_t at = touching.rfind(kBox);
  if (at == std::string::npos) return touching;
  std::size_t number = std::stoul(touching.substr(at + kBox.size()));  // from 1 on
  std::string name(other);
  for (const world::Place& place : world.places) {
    if (place.kind == world::PlaceKind::kObstacle && number-- == 1) name = place.name;
  }
  return touching.replace(at, std::string::npos, name);
}

std::string in_the_way(const world::World& world, model::CollisionModel& judge, const AxisVector& from,
                       const AxisVector& to) {
  constexpr std::string_view kAnd = " and ";
  const double steps = std::ceil(judge.travel(from, to) / model::CollisionModel::kStep_m) + 1;
  for (double step = 0; step <= steps; ++step) {
    const std::string touching = named(world, judge.touching(from + step / steps * (to - from)), "");
    if (!touching.empty()) return touching.substr(touching.find(kAnd) + kAnd.size());
  }
  return {};
}

std::vector<model::Box> surroundings(const world::World& world, std::span<const ObjectBelief> objects, Time from,
                                     Time until, double grow_m) {
  std::vector<model::Box> boxes = standing(world);
  const world::Belt& belt = world.belt;
  const double near_y = belt.y_center_m - 0.5 * belt.width_m, far_y = belt.y_center_m + 0.5 * belt.width_m;
  const double rims_z = rims_z_m(world);
  boxes.push_back(between({-kAround_m, near_y - kAround_m, 0}, {kAround_m, near_y, rims_z}));
  boxes.push_back(between({-kAround_m, far_y, 0}, {kAround_m, far_y + kAround_m, rims_z}));
  boxes.push_back(between({belt.x_start_m, near_y, 0}, {belt.x_end_m, far_y, belt.surface_z_m}));
  boxes.push_back(between({belt.x_end_m, near_y, 0}, {std::max(kAround_m, belt.x_end_m + 1), far_y, rims_z}));
  const double unseen_m = unseen_end_m(world) + to_s(until - from) * belt.speed_m_s;
  if (unseen_m > belt.x_start_m) {
    boxes.push_back(between({belt.x_start_m, near_y, belt.surface_z_m},
                            {unseen_m, far_y, belt.surface_z_m + world.rules.max_size_m}));
  }
  for (const ObjectBelief& object : objects) boxes.push_back(swept(object, belt.surface_z_m, from, until, grow_m));
  return boxes;
}

}  // namespace pons::skills
