#include "pons/skills/route.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace pons::skills {
namespace {

constexpr double kBeltMargin_m = 0.015;    // over the bare belt and rims
constexpr double kObjectMargin_m = 0.020;  // over an object
constexpr double kObjectGrow_m = 0.030;    // around an object's footprint
constexpr double kFreeRadius_m = 0.08;     // about both ends, where the skill knows what it does
constexpr double kCover = 1.0 + 1e-6;
constexpr double kToolRadius_m = 0.045;
constexpr Duration kCheckEvery = std::chrono::milliseconds(20);

// Points of tool or load that come lowest.
std::vector<Vector3> probes(const Load* load) {
  std::vector<Vector3> points;
  if (load == nullptr) {
    for (const double x : {-kToolRadius_m, kToolRadius_m})
      for (const double y : {-kToolRadius_m, kToolRadius_m}) points.emplace_back(x, y, 0.0);
    return points;
  }
  const Eigen::AngleAxisd turn(load->yaw_in_tip_rad, Vector3::UnitZ());
  for (const double x : {-0.5, 0.0, 0.5})
    for (const double y : {-0.5, 0.0, 0.5}) {
      points.push_back(load->offset_in_tip_m +
                       turn * Vector3(x * load->size_m.x(), y * load->size_m.y(), load->size_m.z()));
    }
  return points;
}

}  // namespace

AxisLimits covering(const AxisLimits& limits, const AxisState& start) {
  AxisLimits wider = limits;
  wider.acceleration_rad_s2 = limits.acceleration_rad_s2.cwiseMax(kCover * start.acceleration.cwiseAbs());
  wider.speed_rad_s = limits.speed_rad_s.cwiseMax(kCover * start.speed.cwiseAbs());
  return wider;
}

Router::Router(const world::World& world, model::RobotModel model) : world_(world), model_(std::move(model)) {}

double Router::floor_z(double x, double y, Time time, std::span<const ObjectBelief> obstacles) const {
  double floor = world_.belt.surface_z_m + kBeltMargin_m;
  for (const ObjectBelief& object : obstacles) {
    const Vector3 middle = object.world_from_top.translation() + to_s(time - object.stamp) * object.velocity_m_s;
    const double reach = 0.5 * std::hypot(object.size_m.x(), object.size_m.y()) + kObjectGrow_m;
    if (std::hypot(x - middle.x(), y - middle.y()) < reach) floor = std::max(floor, middle.z() + kObjectMargin_m);
  }
  return floor;
}

// The smallest height over what stands below, along the whole way; positive is clear.
double Router::worst_clearance(const motion::Trajectory& trajectory, const Load* load,
                               std::span<const ObjectBelief> obstacles) {
  const std::vector<Vector3> points = probes(load);
  const Eigen::Index axes = model_.axes();
  const Time begin = trajectory.front().start, end = trajectory.back().end();
  const Vector3 first = model_.world_from_tip(motion::sample(trajectory, begin, axes).position).translation();
  const Vector3 last = model_.world_from_tip(motion::sample(trajectory, end, axes).position).translation();
  double worst = std::numeric_limits<double>::infinity();
  for (Time time = begin; time < end; time += kCheckEvery) {
    const Pose world_from_tip = model_.world_from_tip(motion::sample(trajectory, time, axes).position);
    const Vector3 tip = world_from_tip.translation();
    if ((tip - first).head<2>().norm() < kFreeRadius_m || (tip - last).head<2>().norm() < kFreeRadius_m) continue;
    for (const Vector3& point : points) {
      const Vector3 low = world_from_tip * point;
      worst = std::min(worst, low.z() - floor_z(low.x(), low.y(), time, obstacles));
    }
  }
  return worst;
}

Expected<AxisVector> Router::raised(const AxisVector& q, double tip_z) {
  Pose pose = model_.world_from_tip(q);
  pose.translation().z() = std::max(tip_z, pose.translation().z());
  return model_.inverse(pose, q);
}

Expected<motion::Trajectory> Router::route(const AxisState& start, Time at, const motion::Waypoint& end,
                                           const Load* load, std::span<const ObjectBelief> obstacles,
                                           const AxisLimits& wanted) {
  const AxisLimits limits = covering(wanted, start);
  auto direct = motion::move(start, at, end, limits);
  if (!direct) return direct;
  const double clearance = worst_clearance(*direct, load, obstacles);
  if (clearance >= 0) return direct;

  const AxisVector middle = 0.5 * (start.position + end.position);
  const double depth = load == nullptr ? 0.0 : load->size_m.z();
  const double start_z = model_.world_from_tip(start.position).translation().z();
  const double end_z = model_.world_from_tip(end.position).translation().z();
  double lowest = world_.belt.surface_z_m + kBeltMargin_m + depth;
  for (const ObjectBelief& object : obstacles) {
    lowest = std::max(lowest, object.world_from_top.translation().z() + kObjectMargin_m + depth);
  }
  Error reason{"no clear way", "route", "the cell is too crowded or the end is out of reach"};
  for (const double extra : {0.02, 0.07, 0.14}) {
    const double height =
        std::max(std::min(lowest, std::max(start_z, end_z) - clearance), std::min(start_z, end_z)) + extra;
    const auto over_start = raised(start.position, height);
    const auto over_end = raised(end.position, height);
    const auto over_middle = raised(middle, height);
    std::vector<std::vector<AxisVector>> ways;
    if (over_middle) ways.push_back({*over_middle});
    if (over_start) ways.push_back({*over_start});
    if (over_end) ways.push_back({*over_end});
    if (over_start && over_end) ways.push_back({*over_start, *over_end});
    Expected<motion::Trajectory> best = std::unexpected(reason);
    for (const auto& vias : ways) {
      auto candidate = motion::move_through(start, at, vias, end, limits);
      if (!candidate) {
        reason = candidate.error();
        continue;
      }
      if (best && candidate->back().end() >= best->back().end()) continue;
      if (worst_clearance(*candidate, load, obstacles) < 0) continue;
      best = std::move(candidate);
    }
    if (best) return best;
  }
  return std::unexpected(reason);
}

}  // namespace pons::skills
