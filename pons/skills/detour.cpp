#include "pons/skills/detour.hpp"

#include <utility>
#include <vector>

#include "pons/core/digest.hpp"
#include "pons/motion/path.hpp"

namespace pons::skills {
namespace {

// Together more than what the route's own check in time asks for, between two looks, too.
constexpr model::CollisionMargins kMargins{.scene_m = 0.025, .self_m = 0.01, .load_m = 0.035};
constexpr double kGrow_m = 0.03;  // around what rides on the belt
constexpr Duration kHorizon = std::chrono::seconds(3);
constexpr Duration kCheckEvery = std::chrono::milliseconds(20);
constexpr double kRise_m = 0.05;
constexpr int kRises = 8;
// Enough for a post or a wall in a cell. Some milliseconds a hundred; the bridge waits for it.
constexpr int kSamples = 300, kShortcuts = 40;

std::uint64_t seed_of(const AxisVector& from, const AxisVector& to) {
  Digest digest;
  digest.add(std::span(from.data(), static_cast<std::size_t>(from.size())));
  digest.add(std::span(to.data(), static_cast<std::size_t>(to.size())));
  return digest.value();
}

}  // namespace

Detour::Detour(const world::World& world, const model::RobotModel& model)
    : world_(world), model_(model.copy()), collision_(model.copy(), kMargins) {}

// On the chords of every 20 ms: at its acceleration limit an axis bends off them by a thousandth of a radian.
bool Detour::clear(const motion::Trajectory& way) {
  const auto at = [&](Time time) -> AxisVector { return motion::sample(way, time, model_.axes()).position; };
  const Time end = way.back().end();
  for (Time time = way.front().start; time < end; time += kCheckEvery) {
    if (!collision_.clear(at(time), at(std::min(time + kCheckEvery, end)))) return false;
  }
  return true;
}

bool Detour::keeps_off(const motion::Trajectory& way, const Load* load) {
  const std::vector<model::Box> boxes = standing(world_);
  if (boxes.empty()) return true;
  collision_.surround(boxes);
  collision_.carry(carried(load));
  return clear(way);
}

// Straight up until it is clear.
Expected<AxisVector> Detour::lifted(const AxisVector& q) {
  if (collision_.clear(q)) return q;
  Pose pose = model_.world_from_tip(q);
  for (int step = 0; step < kRises; ++step) {
    pose.translation().z() += kRise_m;
    const auto higher = model_.inverse(pose, q);
    if (!higher) break;
    if (collision_.clear(*higher)) return higher;
  }
  return fail("no clear posture above it: " + collision_.touching(q), "route", "clear the space there");
}

// From rest to rest, past the corners without a halt where that stays clear, else along the path itself.
Expected<motion::Trajectory> Detour::round(const AxisVector& from, Time at, const AxisVector& to,
                                           const AxisLimits& limits) {
  const motion::FreeSpace space{[&](const AxisVector& q) { return collision_.clear(q); },
                                [&](const AxisVector& a, const AxisVector& b) { return collision_.clear(a, b); }};
  const auto path = motion::find_path(from, to, limits, space,
                                      {.seed = seed_of(from, to), .iterations = kSamples, .shortcuts = kShortcuts});
  if (!path) return std::unexpected(path.error());
  const std::vector<AxisVector> corners(path->points.begin() + 1, path->points.end() - 1);
  auto flying = motion::move_through(at_rest(from), at, corners, {to, AxisVector::Zero(to.size())}, limits);
  if (flying && clear(*flying)) return flying;
  return motion::move_straight(from, at, std::span(path->points).subspan(1), limits);
}

Expected<motion::Trajectory> Detour::plan(const AxisState& start, Time at, const motion::Waypoint& end,
                                          const Load* load, std::span<const ObjectBelief> objects,
                                          const AxisLimits& limits) {
  collision_.surround(surroundings(world_, objects, at, at + kHorizon, kGrow_m));
  collision_.carry(carried(load));
  auto way = motion::stop(start, at, limits);  // hardly anything where it rests
  if (!way) return way;
  const AxisVector from = motion::sample(*way, way->back().end(), model_.axes()).position;
  const auto begin = lifted(from), over = lifted(end.position);
  if (!begin) return std::unexpected(begin.error());
  if (!over) return std::unexpected(over.error());
  const auto join = [&](Expected<motion::Trajectory> next) -> Expected<void> {
    if (!next) return std::unexpected(next.error());
    way->insert(way->end(), next->begin(), next->end());
    return {};
  };
  const auto rest_at = [](const AxisVector& q) { return motion::Waypoint{q, AxisVector::Zero(q.size())}; };
  Expected<void> joined;
  if (*begin != from) joined = join(motion::move(at_rest(from), way->back().end(), rest_at(*begin), limits));
  if (joined) joined = join(round(*begin, way->back().end(), *over, limits));
  if (joined && (*over != end.position || !end.speed.isZero())) {
    joined = join(motion::move(at_rest(*over), way->back().end(), end, limits));
  }
  if (!joined) return std::unexpected(joined.error());
  return way;
}

}  // namespace pons::skills
