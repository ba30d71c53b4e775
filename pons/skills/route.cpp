#include "pons/skills/route.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
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
constexpr double kNone = -std::numeric_limits<double>::infinity();  // of clearance
constexpr double kCover = 1.0 + 1e-6;
constexpr double kToolRadius_m = 0.038;
constexpr double kUsualHeight_m = 0.20;  // of what stands on the belt: a way over it is tried first
constexpr Duration kCheckEvery = std::chrono::milliseconds(20);
constexpr int kMostChecks = 80;
constexpr Duration kPiece =
    std::chrono::milliseconds(200);  // of a way that is judged: when it touches is told as exactly

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

double highest_m(const ObjectBelief& object) {
  const Eigen::Matrix3d& axes = object.world_from_top.linear();
  return object.world_from_top.translation().z() + 0.5 * std::abs(axes(2, 0)) * object.size_m.x() +
         0.5 * std::abs(axes(2, 1)) * object.size_m.y();
}

struct Neighbour {
  const ObjectBelief* object;
  double highest_m;
  // The points of tool or load that begin over it or close, and lower than they may: such a one may leave as low as it
  // is. No other swings in below its top.
  std::vector<bool> too_low;
};

std::vector<Neighbour> neighbours_of(const std::vector<Vector3>& points, const Pose& world_from_tip, Time time,
                                     double close_m, std::span<const ObjectBelief> objects) {
  std::vector<Neighbour> neighbours;
  for (const ObjectBelief& object : objects) {
    Neighbour& neighbour = neighbours.emplace_back(&object, highest_m(object));
    for (const Vector3& point : points) {
      const Vector3 low = world_from_tip * point;
      neighbour.too_low.push_back(low.z() < top_z(object, low.x(), low.y(), time, close_m) + kObjectMargin_m);
    }
  }
  return neighbours;
}

// What a tick may search, how much may be spent in one that counts as whole, and what a trajectory costs to plan:
// counted in postures judged, some microseconds each.
constexpr int kWorkPerTick = 5000, kWholeTick = 1000, kRoughWork = 30, kFineWork = 120, kKeepOffWork = 100;
constexpr double kNearly_m = 0.03;   // what a rough way may lack and a fine one have
constexpr double kFineShare = 0.90;  // of a rough way's duration that its fine one may take

// Tried in turn, the fastest clear one is taken: how far along the direct way the via points lie.
const std::vector<std::vector<double>> kVias = {{0.5}, {0.0}, {1.0},  {0.0, 1.0},   {0.0, 0.5},  {0.15},
                                                {0.3}, {0.7}, {0.85}, {0.15, 0.85}, {0.15, 0.5}, {0.3, 0.85}};

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

// What stays the same along one way.
struct Router::Sweep {
  const Positions& at;
  Time begin;
  Pose first, last;
  double further_m;  // down, where the tool arrives
  const Load* load;
  std::vector<Vector3> points;
  std::vector<Neighbour> neighbours;
};

// The smallest height over what stands below, all the time; positive is clear. At the end the tool goes `further_m`
// down. What begins within `close_m` of a neighbour may leave beside it. Once it is less than `enough_m`, no more is
// looked at.
double Router::worst_clearance(const Positions& at, Time begin, Time end, double further_m, double close_m,
                               const Load* load, std::span<const ObjectBelief> obstacles, double enough_m) {
  Sweep sweep{at,           begin, model_.world_from_tip(at(begin)), model_.world_from_tip(at(end)), further_m, load,
              probes(load), {}};
  sweep.neighbours = neighbours_of(sweep.points, sweep.first, begin, close_m, obstacles);
  // Ways between the same ends mostly fail at the same moment: who only asks whether, often knows after that one.
  // A slower way is looked at less often: a height must be searched through within a tick.
  const Duration every = std::max(kCheckEvery, (end - begin) / kMostChecks);
  double worst = std::numeric_limits<double>::infinity();
  if (begin + witness_ < end) worst = clearance_at(begin + witness_, sweep);
  for (Time time = begin; time < end && worst >= enough_m; time += every) {
    const double here = clearance_at(time, sweep);
    if (here < worst) worst = here, witness_ = time - begin;
  }
  return worst;
}

double Router::clearance_at(Time time, const Sweep& sweep) {
  ++work_;
  const AxisVector q = sweep.at(time);
  const Pose world_from_tip = model_.world_from_tip(q);
  const auto close = [&](const Pose& end) {
    return (world_from_tip.translation() - end.translation()).head<2>().norm() < kEndRadius_m;
  };
  const bool leaving = close(sweep.first), arriving = close(sweep.last);
  const double grow_m = leaving || arriving ? kEndGrow_m : kObjectGrow_m;
  double worst = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    const Vector3 low = world_from_tip * sweep.points[i];
    const double as_it_was =
        leaving ? (sweep.first * sweep.points[i]).z() - kSink_m : std::numeric_limits<double>::infinity();
    double floor = std::min(as_it_was, floor_z(low.x(), low.y(), time, sweep.begin, arriving ? 0 : kBeltMargin_m));
    for (const Neighbour& other : sweep.neighbours) {
      if (low.z() - other.highest_m >= kObjectMargin_m) continue;
      const double top = top_z(*other.object, low.x(), low.y(), time, grow_m) + kObjectMargin_m;
      floor = std::max(floor, other.too_low[i] ? std::min(as_it_was, top) : top);
    }
    worst = std::min(worst, low.z() - floor);
  }
  if (sweep.load != nullptr) worst = std::min(worst, own_clearance(q, world_from_tip, *sweep.load) - kOwnMargin_m);
  const double margin_m = kObjectMargin_m + (arriving ? sweep.further_m : 0);
  for (const Neighbour& other : sweep.neighbours) {
    if (world_from_tip.translation().z() + tool_m_ > other.highest_m + margin_m) continue;
    worst = std::min(worst, wrist_clearance(q, *other.object, time, grow_m) - margin_m);
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
                               std::span<const ObjectBelief> obstacles, double enough_m) {
  const AxisState end = motion::sample(way, until, model_.axes());
  const auto at = [&](Time time) -> AxisVector { return motion::sample(way, time, model_.axes()).position; };
  const double further_m = end.speed.isZero(kStill_rad_s) ? 0 : kComesDown_m;
  return worst_clearance(at, from, until, further_m, close_m, load, obstacles, enough_m);
}

bool Router::clear(const motion::Trajectory& way, Time from, Time until, const Load* load,
                   std::span<const ObjectBelief> obstacles) {
  return worst_clearance(way, from, until, kObjectGrow_m, load, obstacles, 0) >= 0 && detour_.keeps_off(way, load);
}

bool Router::clear_at(const AxisVector& q, Time from, Time until, const Load* load,
                      std::span<const ObjectBelief> obstacles) {
  return worst_clearance([&](Time) -> AxisVector { return q; }, from, until, 0, kEndGrow_m, load, obstacles, 0) >= 0;
}

std::string Router::below(const AxisVector& q) {
  const Vector3 tip = model_.world_from_tip(q).translation();
  const bool beside = std::abs(tip.y() - world_.belt.y_center_m) > 0.5 * world_.belt.width_m + kBeltMargin_m;
  const char* const what = beside                    ? "the chutes' rims, or what is as high beside the belt"
                           : tip.x() < unseen_end_m_ ? "what may ride there, where no camera looks"
                                                     : "the belt";
  return fmt::format("{}, with the tip at ({:.2f}, {:.2f}, {:.2f}) m", what, tip.x(), tip.y(), tip.z());
}

std::string Router::lowest_over(Time time, Sweep sweep) {
  const std::vector<Neighbour> neighbours = std::exchange(sweep.neighbours, {});
  if (clearance_at(time, sweep) < 0) return below(sweep.at(time));
  for (const Neighbour& neighbour : neighbours) {
    sweep.neighbours = {neighbour};
    if (clearance_at(time, sweep) >= 0) continue;
    const Vector3& top = neighbour.object->world_from_top.translation();
    if (!neighbour.object->code.empty()) return neighbour.object->code;
    return fmt::format("what lies at ({:.2f}, {:.2f}) m", top.x(), top.y());
  }
  return "what lies there";
}

Expected<void> Router::judge(const motion::Trajectory& way, Time from, Time until, const Load* load,
                             std::span<const ObjectBelief> obstacles) {
  const Time start = way.front().start;
  const auto hit = [&](Time time, const std::string& what) {
    return fail(fmt::format("{:.2f} s on the way the arm would touch {}", to_s(time - start), what), {},
                "lead it around that, or wait until it has gone");
  };
  const Positions at = [&](Time time) -> AxisVector { return motion::sample(way, time, model_.axes()).position; };
  for (Time time = from; time < until; time += kPiece) {
    const std::string what = detour_.touched(at, time, std::min(time + kPiece, until), load, at(start));
    if (!what.empty()) return hit(time, what);
  }
  Sweep sweep{
      at,           from, model_.world_from_tip(at(start)), model_.world_from_tip(at(way.back().end())), 0, load,
      probes(load), {}};
  sweep.neighbours = neighbours_of(sweep.points, sweep.first, start, kObjectGrow_m, obstacles);
  for (Time time = from; time < until; time += kCheckEvery) {
    if (clearance_at(time, sweep) < 0) return hit(time, lowest_over(time, sweep));
  }
  return {};
}

Expected<AxisVector> Router::raised(const AxisVector& q, double tip_z) {
  Pose pose = model_.world_from_tip(q);
  pose.translation().z() = std::max(tip_z, pose.translation().z());
  return model_.inverse(pose, q);
}

Expected<motion::Trajectory> Router::route(const AxisState& start, Time at, const motion::Waypoint& end,
                                           const Load* load, std::span<const ObjectBelief> obstacles,
                                           const AxisLimits& limits, std::optional<Passage>* known) {
  const AxisLimits wider = covering(limits, start);
  std::optional<Passage> none;
  auto way = over({start, at, end, load, obstacles, wider}, known == nullptr ? none : *known);
  if (way || exhausted() || !detour_.has_obstacles()) return way;
  auto round = detour_.plan(start, at, end, load, obstacles, wider);
  if (!round) {
    way.error().what += ", and none round it: " + round.error().line();
  } else if (clear(*round, at, round->back().end(), load, obstacles)) {
    return round;
  }
  return way;
}

Expected<motion::Trajectory> Router::over(const Task& task, std::optional<Passage>& known) {
  auto direct = motion::move(task.start, task.at, task.end, task.limits);
  if (!direct) return direct;
  const double clearance =
      worst_clearance(*direct, task.at, direct->back().end(), kEndGrow_m, task.load, task.obstacles, kNone);
  if (clearance >= 0 && detour_.keeps_off(*direct, task.load)) return direct;

  double depth = 0;  // of the load's lowest point below the tip
  for (const Vector3& point : probes(task.load)) depth = std::max(depth, point.z());
  const double start_z = model_.world_from_tip(task.start.position).translation().z();
  const double end_z = model_.world_from_tip(task.end.position).translation().z();
  double lowest = world_.belt.surface_z_m + kBeltMargin_m + kUsualHeight_m + depth;
  for (const ObjectBelief& object : task.obstacles) {
    lowest = std::max(lowest, highest_m(object) + kObjectMargin_m + depth);
  }
  const double least_z = std::max(std::min(lowest, std::max(start_z, end_z) - clearance), std::min(start_z, end_z));
  if (known && known->leads) {
    auto way = through(*known, least_z, motion::Effort::kFine, task);
    if (way && passes(*way, known->close_m, task)) return way;
  }
  double searched_m = known && !known->leads ? known->higher_m : 0;
  std::optional<Candidate> found, squeezed;
  if (passes(*direct, kObjectGrow_m, task)) squeezed = Candidate{{.close_m = kObjectGrow_m}, *direct};
  for (const double higher_m : {0.02, 0.07, 0.14, 0.25}) {
    if (known && (known->leads ? higher_m < known->higher_m : higher_m <= known->higher_m)) continue;
    const bool whole = work_ < kWholeTick;
    found = fastest(candidates(least_z, higher_m, task), least_z, squeezed, task);
    if (found) break;
    // The next tick begins with the height that this one did not end with; but what fills a whole tick is done with it.
    if (exhausted() && !whole) break;
    searched_m = higher_m;
    if (exhausted()) break;
  }
  if (!found) found = std::move(squeezed);
  if (!found) {
    if (!exhausted() || searched_m > 0 || !known || !known->leads)
      known = Passage{.higher_m = searched_m, .leads = false};
    return fail(exhausted() ? "no clear way found in time" : "no clear way", "route",
                "the cell is too crowded or the end is out of reach");
  }
  known = std::move(found->passage);
  return std::move(found->way);
}

Expected<motion::Trajectory> Router::through(const Passage& passage, double least_z, motion::Effort effort,
                                             const Task& task) {
  if (exhausted()) return fail("no time left to search", "route");
  work_ += effort == motion::Effort::kRough ? kRoughWork : kFineWork;
  std::vector<AxisVector> vias;
  for (const double share : passage.shares) {
    const AxisVector between = task.start.position + share * (task.end.position - task.start.position);
    const auto via = raised(between, least_z + passage.higher_m);
    if (!via) return std::unexpected(via.error());
    vias.push_back(*via);
  }
  return motion::move_through(task.start, task.at, vias, task.end, task.limits, effort);
}

// Roughly, the fastest first.
std::vector<Router::Candidate> Router::candidates(double least_z, double higher_m, const Task& task) {
  std::vector<Candidate> found;
  for (const auto& shares : kVias) {
    Passage passage{higher_m, shares, kEndGrow_m};
    auto way = through(passage, least_z, motion::Effort::kRough, task);
    if (way) found.push_back({std::move(passage), std::move(*way)});
  }
  std::ranges::stable_sort(found, {}, [](const Candidate& c) { return c.way.back().end(); });
  return found;
}

std::optional<Router::Candidate> Router::fastest(std::vector<Candidate> candidates, double least_z,
                                                 std::optional<Candidate>& squeezed, const Task& task) {
  std::optional<Candidate> best;
  const auto takes = [&](const motion::Trajectory& way) { return way.back().end() - task.at; };
  for (Candidate& candidate : candidates) {
    if (best && kFineShare * takes(candidate.way) >= takes(best->way)) break;
    const double clearance = clearance_of(candidate.way, kEndGrow_m, -kNearly_m, task);
    const bool clear = clearance >= 0;
    if (!clear && !squeezed && passes(candidate.way, kObjectGrow_m, task)) {
      squeezed = candidate;
      squeezed->passage.close_m = kObjectGrow_m;
    }
    if (clearance < -kNearly_m) continue;
    auto fine = through(candidate.passage, least_z, motion::Effort::kFine, task);
    const bool finer = fine && (!clear || takes(*fine) < takes(candidate.way)) && passes(*fine, kEndGrow_m, task);
    if (!clear && !finer) continue;
    if (finer) candidate.way = std::move(*fine);
    if (!best || takes(candidate.way) < takes(best->way)) best = std::move(candidate);
  }
  return best;
}

// Less than `enough_m`: by how much less was not looked at.
double Router::clearance_of(const motion::Trajectory& way, double close_m, double enough_m, const Task& task) {
  if (exhausted()) return kNone;
  if (detour_.has_obstacles()) work_ += kKeepOffWork;
  const double least_m =
      worst_clearance(way, way.front().start, way.back().end(), close_m, task.load, task.obstacles, enough_m);
  return least_m < enough_m || detour_.keeps_off(way, task.load) ? least_m : kNone;
}

bool Router::passes(const motion::Trajectory& way, double close_m, const Task& task) {
  return clearance_of(way, close_m, 0, task) >= 0;
}

bool Router::exhausted() const { return work_ >= kWorkPerTick; }

}  // namespace pons::skills
