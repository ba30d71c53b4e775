#include "pons/skills/route.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "pons/motion/axis_profile.hpp"

namespace pons::skills {
namespace {

constexpr double kBeltMargin_m = 0.015;    // over the bare belt and beside it
constexpr double kObjectMargin_m = 0.020;  // over an object
constexpr double kObjectGrow_m = 0.030;    // around an object's footprint,
constexpr double kEndGrow_m = 0.003;       // and close to both ends, where the skill knows what it does
constexpr double kEndRadius_m = 0.08;
constexpr double kComesDown_m = 0.045;  // further, after a way that ends in motion: that is on a parcel's top
constexpr double kOwnMargin_m = 0.03;   // between a load, which swings, and the arm itself
constexpr double kStill_rad_s = 1e-3;
constexpr double kSink_m = 0.005;  // what comes from between others may leave as low as it is
constexpr double kCover = 1.0 + 1e-6;
constexpr double kToolRadius_m = 0.038;
constexpr double kUsualHeight_m = 0.20;  // of what stands on the belt: a way over it is tried first
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
  for (const double x : {-0.5, -0.25, 0.0, 0.25, 0.5})
    for (const double y : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
      const double lower_m = kSwing_rad * std::hypot(x * load->size_m.x(), y * load->size_m.y());
      points.emplace_back(load->offset_in_tip_m +
                          turn * Vector3(x * load->size_m.x(), y * load->size_m.y(), load->size_m.z() + lower_m));
    }
  return points;
}

// Of an object's top face over (x, y), at its own lean; nothing beside its footprint grown by `grow_m`.
double top_z(const ObjectBelief& object, double x, double y, Time time, double grow_m) {
  const Vector3 middle = object.world_from_top.translation() + to_s(time - object.stamp) * object.velocity_m_s;
  const Eigen::Matrix3d& axes = object.world_from_top.linear();
  const Vector3 off = axes.transpose() * Vector3(x - middle.x(), y - middle.y(), 0);
  const bool over =
      std::abs(off.x()) < 0.5 * object.size_m.x() + grow_m && std::abs(off.y()) < 0.5 * object.size_m.y() + grow_m;
  if (!over) return -std::numeric_limits<double>::infinity();
  const Vector3 up = axes.col(2);
  return middle.z() - (up.x() * (x - middle.x()) + up.y() * (y - middle.y())) / up.z();
}

struct Neighbour {
  const ObjectBelief* object;
  // The points of tool or load that begin over it or close, and lower than they may: such a one may leave as low as it
  // is. No other swings in below its top.
  std::vector<bool> too_low;
};

std::vector<Neighbour> neighbours_of(const std::vector<Vector3>& points, const Pose& world_from_tip, Time time,
                                     double close_m, std::span<const ObjectBelief> objects) {
  std::vector<Neighbour> neighbours;
  for (const ObjectBelief& object : objects) {
    Neighbour& neighbour = neighbours.emplace_back(&object);
    for (const Vector3& point : points) {
      const Vector3 low = world_from_tip * point;
      neighbour.too_low.push_back(low.z() < top_z(object, low.x(), low.y(), time, close_m) + kObjectMargin_m);
    }
  }
  return neighbours;
}

double highest_m(const ObjectBelief& object) {
  const Eigen::Matrix3d& axes = object.world_from_top.linear();
  return object.world_from_top.translation().z() + 0.5 * std::abs(axes(2, 0)) * object.size_m.x() +
         0.5 * std::abs(axes(2, 1)) * object.size_m.y();
}

// Tried in turn, the fastest clear one is taken: how far along the direct way the via points lie.
const std::vector<std::vector<double>> kVias = {{0.5},      {0.0},      {1.0},        {0.0, 1.0}, {0.0, 0.5},
                                                {0.15},     {0.3},      {0.7},        {0.85},     {0.15, 0.85},
                                                {0.15, 0.5}, {0.3, 0.85}};

}  // namespace

AxisLimits covering(const AxisLimits& limits, const AxisState& start) {
  AxisLimits wider = limits;
  wider.acceleration_rad_s2 = limits.acceleration_rad_s2.cwiseMax(kCover * start.acceleration.cwiseAbs());
  wider.speed_rad_s = limits.speed_rad_s.cwiseMax(kCover * start.speed.cwiseAbs());
  for (Eigen::Index i = 0; i < start.speed.size(); ++i) {
    // While its acceleration is taken back it gets faster still.
    const double ahead =
        motion::coasting_speed({start.position[i], start.speed[i], start.acceleration[i]}, limits.jerk_rad_s3[i]);
    wider.speed_rad_s[i] = std::max(wider.speed_rad_s[i], kCover * std::abs(ahead));
  }
  return wider;
}

Router::Router(const world::World& world, model::RobotModel model)
    : world_(world),
      unseen_end_m_(unseen_end_m(world)),
      rims_z_m_(rims_z_m(world)),
      tool_m_(world.robot.tool.flange_from_tip.translation().norm()),
      model_(std::move(model)),
      detour_(world, model_) {}

// What a point over (x, y) must stay above at `time` but for objects, when the way was planned at `begin`.
double Router::floor_z(double x, double y, Time time, Time begin, double belt_margin_m) const {
  const world::Belt& belt = world_.belt;
  if (std::abs(y - belt.y_center_m) > 0.5 * belt.width_m + kBeltMargin_m) return rims_z_m_;
  const bool unseen = x < unseen_end_m_ + to_s(time - begin) * belt.speed_m_s;
  return belt.surface_z_m + belt_margin_m + (unseen ? world_.rules.max_size_m : 0);
}

// The smallest height over what stands below, all the time; positive is clear. At the end the tool goes `further_m`
// down. What begins within `close_m` of a neighbour may leave beside it.
double Router::worst_clearance(const Positions& at, Time begin, Time end, double further_m, double close_m,
                               const Load* load, std::span<const ObjectBelief> obstacles) {
  const Pose first = model_.world_from_tip(at(begin)), last = model_.world_from_tip(at(end));
  const auto close = [](const Pose& a, const Pose& b) {
    return (a.translation() - b.translation()).head<2>().norm() < kEndRadius_m;
  };
  const std::vector<Vector3> points = probes(load);
  const std::vector<Neighbour> neighbours = neighbours_of(points, first, begin, close_m, obstacles);
  double worst = std::numeric_limits<double>::infinity();
  for (Time time = begin; time < end; time += kCheckEvery) {
    const AxisVector q = at(time);
    const Pose world_from_tip = model_.world_from_tip(q);
    const bool leaving = close(world_from_tip, first), arriving = close(world_from_tip, last);
    const double grow_m = leaving || arriving ? kEndGrow_m : kObjectGrow_m;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3 low = world_from_tip * points[i];
      const double as_it_was = leaving ? (first * points[i]).z() - kSink_m : std::numeric_limits<double>::infinity();
      double floor = std::min(as_it_was, floor_z(low.x(), low.y(), time, begin, arriving ? 0 : kBeltMargin_m));
      for (const Neighbour& other : neighbours) {
        const double top = top_z(*other.object, low.x(), low.y(), time, grow_m) + kObjectMargin_m;
        floor = std::max(floor, other.too_low[i] ? std::min(as_it_was, top) : top);
      }
      worst = std::min(worst, low.z() - floor);
    }
    if (load != nullptr) worst = std::min(worst, own_clearance(q, world_from_tip, *load) - kOwnMargin_m);
    const double margin_m = kObjectMargin_m + (arriving ? further_m : 0);
    for (const Neighbour& other : neighbours) {
      if (world_from_tip.translation().z() + tool_m_ > highest_m(*other.object) + margin_m) continue;
      worst = std::min(worst, wrist_clearance(q, *other.object, time, grow_m) - margin_m);
    }
  }
  return worst;
}

// Of the links above the tool, which are wider than it, over one object taller than what the tool is at.
double Router::wrist_clearance(const AxisVector& q, const ObjectBelief& object, Time time, double grow_m) {
  model_.place_capsules(q, capsules_);
  double worst = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < capsules_.size(); ++i) {
    if (world_.robot.capsules[i].link == world_.robot.flange_link) continue;
    const model::PlacedCapsule& capsule = capsules_[i];
    for (const double share : {0.0, 0.5, 1.0}) {
      const Vector3 point = capsule.from + share * (capsule.to - capsule.from);
      const double top = top_z(object, point.x(), point.y(), time, capsule.radius_m + grow_m);
      worst = std::min(worst, point.z() - capsule.radius_m - top);
    }
  }
  return worst;
}

// Of the load from the links above the tool: lifted to the height of the base, the arm folds down on it.
double Router::own_clearance(const AxisVector& q, const Pose& world_from_tip, const Load& load) {
  model_.place_capsules(q, capsules_);
  Pose world_from_load = world_from_tip;
  world_from_load.translate(load.offset_in_tip_m);
  world_from_load.rotate(Eigen::AngleAxisd(load.yaw_in_tip_rad, Vector3::UnitZ()));
  world_from_load.translate(Vector3(0, 0, 0.5 * load.size_m.z()));
  const Pose load_from_world = world_from_load.inverse();
  double worst = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < capsules_.size(); ++i) {
    if (world_.robot.capsules[i].link == world_.robot.flange_link) continue;
    const model::PlacedCapsule& capsule = capsules_[i];
    for (const double share : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}) {
      const Vector3 point = load_from_world * Vector3(capsule.from + share * (capsule.to - capsule.from));
      const double apart = (point.cwiseAbs() - 0.5 * load.size_m).cwiseMax(0).norm();
      worst = std::min(worst, apart - capsule.radius_m);
    }
  }
  return worst;
}

double Router::worst_clearance(const motion::Trajectory& way, Time from, Time until, double close_m, const Load* load,
                               std::span<const ObjectBelief> obstacles) {
  const AxisState end = motion::sample(way, until, model_.axes());
  const auto at = [&](Time time) -> AxisVector { return motion::sample(way, time, model_.axes()).position; };
  const double further_m = end.speed.isZero(kStill_rad_s) ? 0 : kComesDown_m;
  return worst_clearance(at, from, until, further_m, close_m, load, obstacles);
}

bool Router::clear(const motion::Trajectory& way, Time from, Time until, const Load* load,
                   std::span<const ObjectBelief> obstacles) {
  return worst_clearance(way, from, until, kObjectGrow_m, load, obstacles) >= 0 && detour_.keeps_off(way, load);
}

bool Router::clear_at(const AxisVector& q, Time from, Time until, const Load* load,
                      std::span<const ObjectBelief> obstacles) {
  return worst_clearance([&](Time) -> AxisVector { return q; }, from, until, 0, kEndGrow_m, load, obstacles) >= 0;
}

Expected<AxisVector> Router::raised(const AxisVector& q, double tip_z) {
  Pose pose = model_.world_from_tip(q);
  pose.translation().z() = std::max(tip_z, pose.translation().z());
  return model_.inverse(pose, q);
}

Expected<motion::Trajectory> Router::route(const AxisState& start, Time at, const motion::Waypoint& end,
                                           const Load* load, std::span<const ObjectBelief> obstacles,
                                           const AxisLimits& limits) {
  const AxisLimits wider = covering(limits, start);
  auto way = over(start, at, end, load, obstacles, wider, kEndGrow_m);
  // Packed in as it is, it leaves as it can: to stay would be worse.
  if (!way) way = over(start, at, end, load, obstacles, wider, kObjectGrow_m);
  // The search takes longer than a tick may: only worlds that name an obstacle pay for it.
  if (way || !detour_.has_obstacles()) return way;
  auto round = detour_.plan(start, at, end, load, obstacles, wider);
  if (!round) {
    way.error().what += ", and none round it: " + round.error().line();
  } else if (clear(*round, at, round->back().end(), load, obstacles)) {
    return round;
  }
  return way;
}

Expected<motion::Trajectory> Router::over(const AxisState& start, Time at, const motion::Waypoint& end,
                                          const Load* load, std::span<const ObjectBelief> obstacles,
                                          const AxisLimits& limits, double close_m) {
  auto direct = motion::move(start, at, end, limits);
  if (!direct) return direct;
  const auto clearance_of = [&](const motion::Trajectory& way) {
    return worst_clearance(way, way.front().start, way.back().end(), close_m, load, obstacles);
  };
  const double clearance = clearance_of(*direct);
  if (clearance >= 0 && detour_.keeps_off(*direct, load)) return direct;

  double depth = 0;  // of the load's lowest point below the tip
  for (const Vector3& point : probes(load)) depth = std::max(depth, point.z());
  const double start_z = model_.world_from_tip(start.position).translation().z();
  const double end_z = model_.world_from_tip(end.position).translation().z();
  double lowest = world_.belt.surface_z_m + kBeltMargin_m + kUsualHeight_m + depth;
  for (const ObjectBelief& object : obstacles) {
    lowest = std::max(lowest, highest_m(object) + kObjectMargin_m + depth);
  }
  Error reason{"no clear way", "route", "the cell is too crowded or the end is out of reach"};
  for (const double extra : {0.02, 0.07, 0.14, 0.25}) {
    const double height =
        std::max(std::min(lowest, std::max(start_z, end_z) - clearance), std::min(start_z, end_z)) + extra;
    std::vector<std::vector<AxisVector>> ways;
    for (const auto& shares : kVias) {
      std::vector<AxisVector> vias;
      for (const double share : shares) {
        const auto via = raised(start.position + share * (end.position - start.position), height);
        if (!via) break;
        vias.push_back(*via);
      }
      if (vias.size() == shares.size()) ways.push_back(std::move(vias));
    }
    Expected<motion::Trajectory> best = std::unexpected(reason);
    for (const auto& vias : ways) {
      auto candidate = motion::move_through(start, at, vias, end, limits);
      if (!candidate) {
        reason = candidate.error();
        continue;
      }
      if (best && candidate->back().end() >= best->back().end()) continue;
      if (clearance_of(*candidate) < 0 || !detour_.keeps_off(*candidate, load)) continue;
      best = std::move(candidate);
    }
    if (best) return best;
  }
  return std::unexpected(reason);
}

}  // namespace pons::skills
