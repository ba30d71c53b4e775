#include "pons/skills/detour.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "pons/core/digest.hpp"
#include "pons/motion/path.hpp"

namespace pons::skills {
namespace {

// Together more than what the route's own check in time asks for, between two looks, too.
constexpr model::CollisionMargins kMargins{.scene_m = kKeepOff_m, .self_m = 0.0, .load_m = 0.035};
constexpr double kGrow_m = 0.03;  // around what rides on the belt
constexpr Duration kHorizon = std::chrono::seconds(3);
constexpr Duration kCheckEvery = std::chrono::milliseconds(20);
// Enough for a post or a wall in a cell; and so many in a tick, which must not become long.
constexpr int kSamples = 400, kShortcuts = 40, kStepsPerTick = 10;
constexpr double kNearly_rad = 0.3;  // from what was asked for before: its path leads round the same things

// Where a way is only looked at: the belt's top counts as so much lower, which leaves a centimetre of the margin; and
// what touches at the beginning may come no closer than by that.
constexpr double kBeltLower_m = 0.015, kNoCloser_m = 0.002;

model::Box belt(const world::World& world, double lower_m) {
  const world::Belt& belt = world.belt;
  const double top_z = belt.surface_z_m - lower_m;
  model::Box box{.size_m = {belt.x_end_m - belt.x_start_m, belt.width_m, top_z}};
  box.world_from_box.translation() = Vector3(0.5 * (belt.x_start_m + belt.x_end_m), belt.y_center_m, 0.5 * top_z);
  return box;
}

std::uint64_t seed_of(const AxisVector& from, const AxisVector& to) {
  Digest digest;
  digest.add(std::span(from.data(), static_cast<std::size_t>(from.size())));
  digest.add(std::span(to.data(), static_cast<std::size_t>(to.size())));
  return digest.value();
}

}  // namespace

Detour::Detour(const world::World& world, const model::RobotModel& model)
    : world_(world),
      has_obstacles_(!standing(world).empty()),
      model_(model.copy()),
      collision_(model.copy(), kMargins),
      scene_(model.copy(), {.scene_m = kMargins.scene_m}) {
  scene_.surround(standing(world));
}

// On the chords of every 20 ms: at its acceleration limit an axis bends off them by a thousandth of a radian.
bool Detour::clear(const motion::Trajectory& way, model::CollisionModel& judge) {
  const auto at = [&](Time time) -> AxisVector { return motion::sample(way, time, model_.axes()).position; };
  const Time end = way.back().end();
  for (Time time = way.front().start; time < end; time += kCheckEvery) {
    if (!judge.clear(at(time), at(std::min(time + kCheckEvery, end)))) return false;
  }
  return true;
}

bool Detour::keeps_off(const motion::Trajectory& way, const Load* load) {
  if (!has_obstacles_) return true;
  scene_.carry(carried(load));
  return clear(way, scene_);
}

std::string Detour::touched(const std::function<AxisVector(Time)>& at, Time from, Time until, const Load* load,
                            const AxisVector& leaves) {
  std::vector<model::Box> boxes = standing(world_);
  boxes.push_back(belt(world_, kBeltLower_m));
  collision_.surround(boxes);
  collision_.carry(carried(load));
  const double least_m = std::min(0.0, collision_.clearance(leaves) - kNoCloser_m);
  for (Time time = from; time < until; time += kCheckEvery) {
    const AxisVector a = at(time), b = at(std::min(time + kCheckEvery, until));
    if (collision_.clear(a, b)) continue;
    for (const AxisVector& q : {a, AxisVector(0.5 * (a + b)), b}) {
      if (collision_.clearance(q) > least_m) continue;
      return named(world_, collision_.touching(q), "the belt");
    }
  }
  return {};
}

Expected<AxisVector> Detour::lifted(const AxisVector& q) {
  if (auto clear = skills::lifted(model_, collision_, q)) return *std::move(clear);
  return fail("no clear posture above it: " + named(world_, collision_.touching(q), "what lies there"), "route",
              "clear the space there");
}

Expected<std::vector<AxisVector>> Detour::corners(const AxisVector& from, const AxisVector& to, const Vector3& load_m,
                                                  const AxisLimits& limits) {
  const auto near = [](const AxisVector& a, const AxisVector& b) {
    return (a - b).cwiseAbs().maxCoeff() < kNearly_rad;
  };
  const bool same = sought_ && sought_->load_m == load_m && near(sought_->from, from) && near(sought_->to, to);
  const Error unfinished{"no way round found yet", "route", "ask again in the next tick"};
  if (!same && advanced_) return std::unexpected(unfinished);  // one search a tick
  if (!same) {
    const motion::PathSearch search{.seed = seed_of(from, to), .iterations = kSamples, .shortcuts = kShortcuts};
    sought_ = Sought{from, to, load_m, motion::PathFinder(from, to, limits, search), {}};
  }
  if (sought_->corners) return *sought_->corners;
  if (std::exchange(advanced_, true)) return std::unexpected(unfinished);
  const motion::FreeSpace space{[&](const AxisVector& q) { return collision_.clear(q); },
                                [&](const AxisVector& a, const AxisVector& b) { return collision_.clear(a, b); }};
  const auto ended = sought_->finder.advance(kStepsPerTick, space);
  if (!ended) return std::unexpected(unfinished);
  if (!*ended) {
    sought_.reset();
    Error none = ended->error();
    const std::string past = in_the_way(world_, scene_, from, to);
    if (!past.empty()) none.what = "no way past " + past + ": " + none.what;
    return std::unexpected(none);
  }
  const std::vector<AxisVector>& points = (*ended)->points;
  sought_->corners.emplace(points.begin() + 1, points.end() - 1);
  return *sought_->corners;
}

// From rest to rest, past the corners without a halt where that stays clear, else along the path itself.
Expected<motion::Trajectory> Detour::round(const AxisVector& from, Time at, const AxisVector& to,
                                           const std::vector<AxisVector>& corners, const AxisLimits& limits) {
  auto flying = motion::move_through(at_rest(from), at, corners, {to, AxisVector::Zero(to.size())}, limits);
  if (flying && clear(*flying, collision_)) return flying;
  std::vector<AxisVector> points = corners;
  points.push_back(to);
  auto straight = motion::move_straight(from, at, points, limits);
  if (straight && clear(*straight, collision_)) return straight;
  sought_.reset();
  if (!straight) return straight;
  return fail("the way round is no longer clear", "route", "ask again");
}

Expected<motion::Trajectory> Detour::plan(const AxisState& start, Time at, const motion::Waypoint& end,
                                          const Load* load, std::span<const ObjectBelief> objects,
                                          const AxisLimits& limits) {
  collision_.surround(surroundings(world_, objects, at, at + kHorizon, kGrow_m));
  collision_.carry(carried(load));
  scene_.carry(carried(load));
  auto way = motion::stop(start, at, limits);  // hardly anything where it rests
  if (!way) return way;
  const AxisVector from = motion::sample(*way, way->back().end(), model_.axes()).position;
  const auto begin = lifted(from), over = lifted(end.position);
  if (!begin) return std::unexpected(begin.error());
  if (!over) return std::unexpected(over.error());
  const auto turns = corners(*begin, *over, load != nullptr ? load->size_m : Vector3::Zero(), limits);
  if (!turns) return std::unexpected(turns.error());
  const auto join = [&](Expected<motion::Trajectory> next) -> Expected<void> {
    if (!next) return std::unexpected(next.error());
    way->insert(way->end(), next->begin(), next->end());
    return {};
  };
  const auto rest_at = [](const AxisVector& q) { return motion::Waypoint{q, AxisVector::Zero(q.size())}; };
  Expected<void> joined;
  if (*begin != from) joined = join(motion::move(at_rest(from), way->back().end(), rest_at(*begin), limits));
  if (joined) joined = join(round(*begin, way->back().end(), *over, *turns, limits));
  if (joined && (*over != end.position || !end.speed.isZero())) {
    joined = join(motion::move(at_rest(*over), way->back().end(), end, limits));
  }
  if (!joined) return std::unexpected(joined.error());
  return way;
}

}  // namespace pons::skills
