#include "pons/skills/reach.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numbers>

#include "pons/motion/path.hpp"
#include "pons/skills/cell.hpp"
#include "pons/skills/scenery.hpp"
#include "pons/world/mouth.hpp"

namespace pons::skills {
namespace {

// To each of the postures over a place; a skill draws 400 to one.
constexpr int kSamples = 1000;
// Between two postures of a line that is free nothing farther in than this goes unseen: so much less is kept off here
// than by a skill, or a way of its could be none of ours.
constexpr double kUnseen_m = 0.5 * model::CollisionModel::kStep_m;
constexpr double kSame_rad = 1e-6;
// Of a way that is given.
constexpr Duration kPiece = std::chrono::milliseconds(20);
constexpr int kMostLooks = 2000;

}  // namespace

Reach::Reach(const world::World& world, const model::RobotModel& model) : world_(world), model_(model.copy()) {
  const std::vector<model::Box> boxes = standing(world);
  if (boxes.empty()) return;
  standing_.emplace(model.copy(), model::CollisionMargins{});
  standing_->surround(boxes);
  kept_off_.emplace(model.copy(), model::CollisionMargins{.scene_m = kKeepOff_m - kUnseen_m});
  kept_off_->surround(boxes);
}

std::string Reach::touching(const AxisVector& posture) { return named(world_, standing_->touching(posture), {}); }

Expected<AxisVector> Reach::posture(const Vector3& point, const std::string& what) {
  std::string touches;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Pose pose = Cell::tip_down(point, 0.5 * std::numbers::pi * quarter);
    auto found = model_.inverse(pose, world_.robot.home, model::Among::kAllBranches);
    if (!found) continue;
    if (!standing_ || standing_->clear(*found)) return found;
    touches = touching(*found);
  }
  if (touches.empty()) return fail(what + " is out of reach", {}, "name something nearer");
  return fail(fmt::format("over {} the arm touches what stands there ({})", what, touches), {}, "name something else");
}

Expected<void> Reach::look(const world::Place& place, std::span<const double> heights_m) {
  const auto at = [&](double height_m) { return posture(place.center_m + Vector3(0, 0, height_m), place.name); };
  auto nearest = at(heights_m.front());
  for (const double height_m : heights_m.subspan(1)) {
    if (nearest) break;
    if (auto higher = at(height_m)) nearest = std::move(higher);
  }
  if (kept_off_) return led_to(place, heights_m, nearest);
  if (!nearest) return std::unexpected(nearest.error());
  return {};
}

// One of all postures over the place is enough; mostly it is the nearest, and straight.
Expected<void> Reach::led_to(const world::Place& place, std::span<const double> heights_m,
                             const Expected<AxisVector>& nearest) {
  const AxisVector& at_home = world_.robot.home;
  const std::optional<AxisVector> home = lifted(model_, *kept_off_, at_home);
  if (!home)
    return fail(fmt::format("no way leads from home: there the arm is less than {:.0f} mm off {}", 1e3 * kKeepOff_m,
                            in_the_way(world_, *kept_off_, at_home, at_home)),
                {}, "move that, or home");
  if (nearest && kept_off_->clear(*home, *nearest)) return {};
  const std::vector<AxisVector> goals = postures(place, heights_m);
  if (goals.empty() && !nearest) return std::unexpected(nearest.error());
  const motion::FreeSpace space{[&](const AxisVector& q) { return kept_off_->clear(q); },
                                [&](const AxisVector& a, const AxisVector& b) { return kept_off_->clear(a, b); }};
  const auto led = [&](const AxisVector& goal) {
    return motion::find_path(*home, goal, world_.robot.limits, space, {.iterations = kSamples, .shortcuts = 0});
  };
  if (std::ranges::any_of(goals, [&](const AxisVector& goal) { return led(goal).has_value(); })) return {};
  const std::string past = in_the_way(world_, *kept_off_, *home, goals.empty() ? *nearest : goals.front());
  return fail(fmt::format("no way leads from home to over {} past {} ({} samples searched)", place.name, past,
                          kSamples * goals.size()),
              {}, fmt::format("name another place, or move {}: ways keep {:.0f} mm off it", past, 1e3 * kKeepOff_m));
}

// Tool down over it, on every branch, the nearest to home first; and with the first axis a whole turn further, from
// where a way may lead that is shut from here. What is too close to what stands there is come down to from above, as
// skills do. What a straight line joins to one before it is left out: a way to either is one to both.
std::vector<AxisVector> Reach::postures(const world::Place& place, std::span<const double> heights_m) {
  const AxisVector& home = world_.robot.home;
  const auto far = [&](const AxisVector& q) { return (q - home).squaredNorm(); };
  std::vector<AxisVector> all;
  model::BranchSolutions solutions;
  for (const double height_m : heights_m) {
    std::vector<AxisVector> found;
    for (const double turn : {0.0, 2 * std::numbers::pi, -2 * std::numbers::pi}) {
      AxisVector seed = home;
      seed[0] += turn;
      for (int quarter = 0; quarter < 4; ++quarter) {
        const Vector3 point = place.center_m + Vector3(0, 0, height_m);
        model_.inverse_all(Cell::tip_down(point, 0.5 * std::numbers::pi * quarter), seed, solutions);
        std::ranges::transform(solutions, std::back_inserter(found), &model::BranchSolution::q);
      }
    }
    std::ranges::sort(found, {}, far);
    const auto same = [](const AxisVector& a, const AxisVector& b) { return (a - b).isZero(kSame_rad); };
    const auto again = std::ranges::unique(found, same);
    found.erase(again.begin(), again.end());
    const auto joined = [&](const AxisVector& q) {
      const auto apart = [&](const AxisVector& other) { return (q - other).squaredNorm(); };
      const auto before = std::ranges::min_element(all, {}, apart);
      return before != all.end() && kept_off_->clear(q, *before);
    };
    for (const AxisVector& q : found) {
      if (!standing_->clear(q)) continue;
      if (auto over = lifted(model_, *kept_off_, q); over && !joined(*over)) all.push_back(*std::move(over));
    }
  }
  std::ranges::sort(all, {}, far);
  return all;
}

Expected<void> Reach::over(const std::string& place, std::span<const double> heights_m) {
  const world::Place* const target = world_.place(place);
  if (target == nullptr || heights_m.empty()) return {};  // the schema knows the names; "home" is no place
  const auto key = std::pair(place, heights_m.front());
  const auto known = known_.find(key);
  return known != known_.end() ? known->second : known_.emplace(key, look(*target, heights_m)).first->second;
}

void Reach::foresee(const std::string& place, std::span<const double> heights_m) {
  if (standing_) (void)over(place, heights_m);
}

Expected<void> Reach::stands_free(const AxisVector& posture, const std::string& what) {
  if (!standing_ || standing_->clear(posture)) return {};
  return fail(fmt::format("at {} the arm touches what stands there ({})", what, touching(posture)), {},
              "lead it around that");
}

// As long as no point of the arm has gone as far as the arm was clear, it cannot have touched anything.
std::optional<Reach::Touch> Reach::touches(std::span<const Segment> way) {
  if (!standing_ || way.empty()) return {};
  double free_m = 0;
  int looks = 0;
  AxisVector before = motion::sample(way, way.front().start, model_.axes()).position;
  const Time end = way.back().end();
  for (Time at = way.front().start; at < end && looks < kMostLooks; at += kPiece) {
    const AxisVector q = motion::sample(way, at, model_.axes()).position;
    free_m -= standing_->travel(before, q);
    before = q;
    if (free_m > 0) continue;
    ++looks;
    const double clear_m = standing_->clearance(q);
    if (clear_m <= 0) return Touch{at, touching(q)};
    free_m = std::max(clear_m, kUnseen_m);
  }
  return {};
}

Expected<void> Reach::can_press(const AxisVector& posture, double force_n) {
  const AxisVector still = AxisVector::Zero(posture.size());
  AxisVector torque_nm = still;
  model_.inverse_dynamics(posture, still, still, {}, torque_nm);
  // What is pressed on pushes the tip up: the drives give that much more, by the Jacobian's transpose.
  Vector6 on_tip = Vector6::Zero();
  on_tip[2] = force_n;
  torque_nm -= model_.tip_jacobian(posture).transpose() * on_tip;
  const AxisVector& most_nm = world_.robot.limits.torque_nm;
  for (Eigen::Index axis = 0; axis < posture.size(); ++axis) {
    if (std::abs(torque_nm[axis]) <= most_nm[axis]) continue;
    return fail(fmt::format("axis {} would have to give {:.0f} of its {:.0f} N·m", axis + 1, std::abs(torque_nm[axis]),
                            most_nm[axis]),
                {}, "ask for less force");
  }
  return {};
}

Expected<void> passes(const ObjectBelief* object, const world::Place* place) {
  if (object == nullptr || place == nullptr || place->kind != world::PlaceKind::kChute) return {};
  const Vector3& size = object->size_m;
  if (!world::ways_in(size, *place, world::kMisjudged_m).empty()) return {};
  return fail(fmt::format("{} is {:.2f} x {:.2f} m, too large for the mouth of {}", object->code, size.x(), size.y(),
                          place->name),
              {}, "let it ride, or name a place without a mouth");
}

}  // namespace pons::skills
