#include "pons/skills/grasp.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "pons/skills/grip.hpp"
#include "pons/skills/scale.hpp"

namespace pons::skills {
namespace {

constexpr double kPressFurther_m = 0.003, kPressTakes_s = 0.08, kPressRides_s = 0.4;
constexpr double kPressedHard_kg = 5.5;  // what the wrist feels then; a parcel bears twice as much
constexpr double kTouched_kg = 0.25;     // and of anything that the cups touch
constexpr int kPresses = 2;
constexpr double kDeeper_m = 0.015, kDeeper_m_s = 0.15;
constexpr double kSlips_m = 0.010;     // between cups and what they touch; that much they give way
constexpr double kOverBelt_m = 0.012;  // the thinnest is as high
constexpr int kDeepest = 3;
constexpr double kWithin_m = 0.02;    // the zone, where the arm waits,
constexpr double kWait_m = 0.15;      // over the parcel that it waits for,
constexpr double kWaitOver_m = 0.06;  // and over the others, which pass below

constexpr double kHover_m = 0.035;      // the straight part above the parcel
constexpr double kComeDown_m_s = 0.25;  // speed there
constexpr double kPress_m = 0.006;      // bellows pressed together at the contact
constexpr double kRide_s = 0.40;        // along with the belt, while vacuum builds
constexpr double kKnot_s = 0.05;
constexpr double kConverged_s = 0.002;
constexpr double kLater_s = 0.20, kLatest_s = 0.20;  // a step, and the most, when the way is blocked
constexpr int kRounds = 8, kStraightRounds = 2;
constexpr double kUpright = 0.9986, kSteepest = 0.80;  // cosines of 3 and 37 degrees
constexpr double kLeastLift_m = 0.10, kHighestLift_m = 0.25;
constexpr double kClose_m = 0.05;      // neighbours within this of the footprint are lifted over
constexpr double kClear_m = 0.02;      // by this much
constexpr double kAway_m = 0.02;       // from them, during the lift
constexpr double kOneSided = 0.3;      // of the sum of unit vectors
constexpr double kLeastJerk = 5.7735;  // largest acceleration of a least-jerk motion times duration² over length
constexpr double kThinnest_m = 0.005;  // of what is carried
constexpr double kSlower = 1.25;
constexpr double kEmptyTorqueShare = 0.96, kBoldest = 0.7;  // of the drives' torques; of one correction
// Times the mass limit, as it comes off what it lay on: then the bellows of the heaviest that is sorted tighten, and it
// pulls like 2.6 times its own weight; and as much as that does what is heavier than two together may be.
constexpr double kPulls = 1.5, kTears = 3.6;
// Of any axis from where it is told to be; with drives that act late it is 0.020 at most.
constexpr double kGivesWay_rad = 0.022;
constexpr double kGentle = 0.3;           // of the acceleration limits, for what is lifted in another way
constexpr double kGainsMost_m_s2 = 0.15;  // of a belt whose speed wanders
constexpr double kRideLifted_s = 0.8;     // with the belt, to be weighed

void append(motion::Trajectory& to, const motion::Trajectory& from) { to.insert(to.end(), from.begin(), from.end()); }

Vector3 belt_velocity(const Cell& cell) { return {cell.belt_speed_m_s(), 0, 0}; }

Pose posed(const Vector3& position, const Eigen::Matrix3d& orientation) {
  Pose pose = Pose::Identity();
  pose.translation() = position;
  pose.linear() = orientation;
  return pose;
}

// The cups seal on a leaning top only when they lean with it.
Expected<Eigen::Quaterniond> lean_of(const ObjectBelief& object) {
  const Vector3 up = object.world_from_top.linear().col(2);
  if (up.z() > kUpright) return Eigen::Quaterniond::Identity();
  if (up.z() < kSteepest) return fail("its top leans too steeply to be gripped", "grasp", "let it ride or lay it flat");
  return Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), up);
}

const Vector3 kHover{0, 0, kHover_m};

motion::Waypoint coming_down(Cell& cell, const AxisVector& q) {
  return {q, joint_speed(cell, q, belt_velocity(cell) - Vector3(0, 0, kComeDown_m_s))};
}

// The tip's position, speed and acceleration, by differences.
std::array<Vector3, 3> tip_motion(Cell& cell, const AxisState& state) {
  constexpr double kStep_s = 1e-3;
  const auto tip = [&](double t) -> Vector3 {
    const AxisVector q = state.position + t * state.speed + 0.5 * t * t * state.acceleration;
    return cell.model.world_from_tip(q).translation();
  };
  const Vector3 before = tip(-kStep_s), now = tip(0), after = tip(kStep_s);
  return {now, (after - before) / (2 * kStep_s), (after - 2 * now + before) / (kStep_s * kStep_s)};
}

// Starting as told, ending at standstill in `end`: the quintic of least jerk in each coordinate.
std::function<Vector3(double)> least_jerk(const std::array<Vector3, 3>& start, const Vector3& end, double duration_s) {
  const double d = duration_s;
  const auto& [p, v, a] = start;
  const Vector3 way = end - p;
  const Vector3 c3 = (10 * way - 6 * d * v - 1.5 * d * d * a) / (d * d * d);
  const Vector3 c4 = (-15 * way + 8 * d * v + 1.5 * d * d * a) / (d * d * d * d);
  const Vector3 c5 = (6 * way - 3 * d * v - 0.5 * d * d * a) / (d * d * d * d * d);
  return [=](double t) -> Vector3 { return p + t * (v + t * (0.5 * a + t * (c3 + t * (c4 + t * c5)))); };
}

std::string name_of(const ObjectBelief& object) {
  return object.code.empty() ? fmt::format("track {}", object.track) : object.code;
}

// Where an axis is so near its limit that the arm cannot go with the belt: up as seen from the floor.
Expected<Lift> straight_up(Cell& cell, const AxisState& start, Time at, const Eigen::Matrix3d& orientation,
                           const Vector3& offset) {
  AxisLimits limits = cell.limits_empty();
  limits.acceleration_rad_s2 *= kGentle;
  auto up = nudge(cell, start, at, orientation, offset, Vector3::Zero(), limits);
  if (!up) return std::unexpected(up.error());
  const Time end = up->back().end();
  return Lift{std::move(*up), end, end};
}

}  // namespace

double yaw_of(const Eigen::Matrix3d& orientation) { return std::atan2(orientation(1, 0), orientation(0, 0)); }

AxisVector joint_speed(Cell& cell, const AxisVector& q, const Vector3& tip_speed_m_s) {
  const model::Jacobian jacobian = cell.model.tip_jacobian(q);
  Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();
  twist.head<3>() = tip_speed_m_s;
  // Damped: near a singular pose the speed is wrong by a little rather than infinite.
  const Eigen::Matrix<double, 6, 6> gram =
      jacobian * jacobian.transpose() + 1e-6 * Eigen::Matrix<double, 6, 6>::Identity();
  return jacobian.transpose() * gram.ldlt().solve(twist);
}

Expected<Eigen::Matrix3d> nearest_orientation(Cell& cell, const AxisVector& q, const Vector3& position,
                                              double object_yaw_rad, const Eigen::Quaterniond& lean) {
  Expected<Eigen::Matrix3d> best = fail("out of reach", "grasp");
  double least = 0;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double yaw = object_yaw_rad + quarter * std::numbers::pi / 2;
    const Eigen::Matrix3d orientation = lean * Cell::tip_down(position, yaw).linear();
    const auto there = cell.model.inverse(posed(position, orientation), q);
    if (!there) continue;
    const double turn = cell.effort(q, *there);
    if (best && turn >= least) continue;
    best = orientation;
    least = turn;
  }
  return best;
}

Expected<motion::Trajectory> ride(Cell& cell, const AxisState& start, Time at, const Eigen::Matrix3d& orientation,
                                  double duration_s) {
  const Vector3 from = cell.model.world_from_tip(start.position).translation();
  const Vector3 speed = belt_velocity(cell);
  AxisVector seed = start.position;
  const auto path = [&, seed](double t) mutable -> Expected<AxisVector> {
    auto q = cell.model.inverse(posed(from + t * speed, orientation), seed);
    if (q) seed = *q;
    return q;
  };
  return motion::follow(start, at, path, duration_s, kKnot_s, cell.limits_empty());
}

Expected<motion::Trajectory> nudge(Cell& cell, const AxisState& start, Time at, const Eigen::Matrix3d& orientation,
                                   const Vector3& offset, const Vector3& tip_speed, const AxisLimits& limits) {
  const Vector3 from = cell.model.world_from_tip(start.position).translation();
  const auto q = cell.model.inverse(posed(from + offset, orientation), start.position);
  if (!q) return std::unexpected(q.error());
  return motion::move(start, at, {*q, joint_speed(cell, *q, tip_speed)}, covering(limits, start));
}

std::optional<task::Progress> never_taken(const world::World& world, const ObjectBelief& object) {
  using task::Progress, task::Status;
  if (world.rules.too_large(object.size_m))
    return Progress{Status::kException, fmt::format("too large: {:.2f} m", object.size_m.maxCoeff()), {}};
  if (object.world_from_top.translation().x() <= world.belt.pick_x_max_m) return std::nullopt;
  if (world.next_arm.empty()) return Progress{Status::kException, "rode past the pick zone", {}};
  return Progress{Status::kFailed, "rode past the pick zone of " + world.arm, {}};  // another arm may take it
}

std::optional<task::Progress> better_left(const Cell& cell, const ObjectBelief& object) {
  if (cell.strays->may_have_fallen(object.code)) return not_there(cell, object.code);
  const world::Belt& belt = cell.world.belt;
  const auto x_m = [](const ObjectBelief& one) { return one.world_from_top.translation().x(); };
  if (x_m(object) >= belt.pick_x_min_m || !cell.belt_stands()) return std::nullopt;
  const auto other = std::ranges::find_if(
      cell.objects(), [&](const ObjectBelief& one) { return !one.code.empty() && belt.must_wait_for(x_m(one), 0); });
  if (other == cell.objects().end()) return std::nullopt;
  return task::Progress{task::Status::kFailed, "the belt waits for " + other->code, {}};
}

task::Progress overweight(double mass_kg) {
  return {task::Status::kException, fmt::format("overweight: {:.2f} kg", mass_kg), {{"mass_kg", mass_kg}}};
}

std::optional<task::Progress> never_lifted(const Cell& cell, double felt_kg) {
  using task::Progress, task::Status;
  if (felt_kg > kTears * cell.world.rules.max_mass_kg)
    return Progress{Status::kException, fmt::format("overweight: it pulls like {:.0f} kg", felt_kg), {}};
  const link::State& state = cell.arm.state();
  const double off_rad = (state.commanded.position - state.position).cwiseAbs().maxCoeff();
  if (felt_kg > kPulls * cell.world.rules.max_mass_kg && off_rad > kGivesWay_rad)
    return Progress{Status::kRetry, "it pulls the arm off its way", {}};
  return std::nullopt;
}

std::optional<task::Progress> not_as_it_hangs(const world::World& world, const Held& held) {
  using task::Progress, task::Status;
  if (held.doubtful) return Progress{Status::kException, "it may be another: nobody has seen it", {}};
  if (!held.alone) return Progress{Status::kRetry, "another may hang on it", {}};
  if (held.mass_kg > world.rules.max_mass_kg) return overweight(held.mass_kg);
  if (held.mass_kg <= kLightest_kg) return Progress{Status::kRetry, "something bears it", {}};
  return std::nullopt;
}

task::Progress too_weak(const world::World& world) {
  using task::Progress, task::Status;
  return {world.next_arm.empty() ? Status::kException : Status::kFailed, "the vacuum is too weak", {}};
}

task::Progress not_there(const Cell& cell, const std::string& code) {
  using task::Progress, task::Status;
  if (cell.disputed(code)) return {Status::kFailed, "it shows two codes", {}};
  const std::string* const place = cell.strays->place_of(code);
  if (place == nullptr) return {Status::kFailed, "lost from sight", {}};
  const char* const how = cell.strays->may_have_fallen(code) ? "it or its neighbour fell" : "came along with another,";
  return {Status::kException, fmt::format("{} into {}", how, *place), {{"fell_into", *place}}};
}

std::optional<std::string> tied_to(const Cell& cell, const ObjectBelief& object) {
  if (object.half_seen) return "a part of it was never seen";
  for (const ObjectBelief& other : cell.objects()) {
    if (other.track == 0) continue;  // only an obstacle
    if (lies_on(other, object)) return "covered by " + name_of(other);
    if (is_part(other, object)) return "may be two: " + name_of(other);
  }
  return std::nullopt;
}

Vector3 lift_offset(const Cell& cell, const ObjectBelief& target) {
  Vector3 offset{0, 0, kLeastLift_m}, away = Vector3::Zero();
  const Vector3 top = target.world_from_top.translation();
  const double own_m = 0.5 * target.size_m.head<2>().norm() + kClose_m;
  for (const ObjectBelief& object : cell.objects()) {
    if (object.track == target.track) continue;
    const Vector3 other = object.world_from_top.translation();
    const Eigen::Vector2d apart = (other - cell.predict(target, object.stamp)).head<2>();
    if (apart.norm() > own_m + 0.5 * object.size_m.head<2>().norm()) continue;
    offset.z() = std::max(offset.z(), other.z() - (top.z() - target.size_m.z()) + kClear_m);
    away.head<2>() -= apart.normalized();
  }
  offset.z() = std::min(offset.z(), kHighestLift_m);
  // Between two on opposite sides there is no way out but up.
  if (away.norm() > kOneSided) offset += kAway_m * away.normalized();
  return offset;
}

Load load_of(const ObjectBelief& object, const Eigen::Matrix3d& orientation) {
  const Eigen::Matrix3d& axes = object.world_from_top.linear();
  const double middle_over_edge_m = 0.5 * axes.row(2).head<2>().cwiseAbs().dot(object.size_m.head<2>());
  Load load{.size_m = object.size_m, .yaw_in_tip_rad = yaw_of(orientation) - yaw_of(axes)};
  load.size_m.z() = std::max(kThinnest_m, (object.size_m.z() - middle_over_edge_m) / axes(2, 2));
  return load;
}

Expected<motion::Trajectory> way_to_wait(Cell& cell, const ObjectBelief& object, const Grasp& grasp, Time now) {
  const Time from = cell.arm.splice_time(now);
  const AxisState state = cell.arm.planned(from);
  Vector3 point = grasp.contact_point;
  point.x() = cell.world.belt.pick_x_min_m + kWithin_m;
  point.z() = object.world_from_top.translation().z() + kWait_m;
  for (const ObjectBelief& other : cell.objects())
    point.z() = std::max(point.z(), other.world_from_top.translation().z() + kWaitOver_m);
  const auto q = cell.model.inverse(Cell::tip_down(point, yaw_of(grasp.orientation)), state.position);
  if (!q) return std::unexpected(q.error());
  return cell.router.route(state, from, {*q, AxisVector::Zero(q->size())}, nullptr, cell.objects(),
                           cell.limits_empty());
}

Expected<PressedDown> press_down(Cell& cell, Time now, const Eigen::Matrix3d& orientation, Presses& presses) {
  const double pushed_kg = -weigh_now(cell);
  const bool touches = pushed_kg > kTouched_kg || cell.arm.cups().sealed_cups > 0;
  int& tried = touches ? presses.further : presses.deeper;
  if (pushed_kg > kPressedHard_kg || tried >= (touches ? kPresses : kDeepest)) return fail("pressed enough", "grasp");
  const Time from = cell.arm.splice_time(now);
  const AxisState start = cell.arm.planned(from);
  const double tip_z = cell.model.world_from_tip(start.position).translation().z();
  const double by_m =
      touches ? kPressFurther_m : std::min(kDeeper_m, tip_z - cell.world.belt.surface_z_m - kOverBelt_m);
  if (by_m <= 0) return fail("there is only the belt", "grasp");
  const Vector3 belt{cell.belt_speed_m_s(), 0, 0};
  const double takes_s = kPressTakes_s + (by_m - kPressFurther_m) / kDeeper_m_s;
  auto down = nudge(cell, start, from, orientation, takes_s * belt - Vector3(0, 0, by_m), belt, cell.limits_empty());
  if (!down) return std::unexpected(down.error());
  const Time end = down->back().end();
  const auto along = ride(cell, motion::sample(*down, end, cell.model.axes()), end, orientation, kPressRides_s);
  if (!along) return std::unexpected(along.error());
  down->insert(down->end(), along->begin(), along->end());
  ++tried;
  return PressedDown{*std::move(down), end};
}

bool Slip::is_over(Cell& cell, bool touches) {
  if (!touches && !met_at_m_) return false;
  const link::State& state = cell.arm.state();
  const double tip_m = cell.model.world_from_tip(state.commanded.position).translation().x() - state.belt_travel_m;
  if (!met_at_m_) met_at_m_ = tip_m;
  return std::abs(tip_m - *met_at_m_) > kSlips_m;
}

ObjectBelief held_at(const Held& held, const Pose& world_from_tip) {
  ObjectBelief object;
  object.size_m = held.load.size_m;
  object.world_from_top = world_from_tip * Eigen::Translation3d(held.load.offset_in_tip_m);
  const double yaw = yaw_of(world_from_tip.linear()) - held.load.yaw_in_tip_rad;
  object.world_from_top.linear() = Eigen::AngleAxisd(yaw, Vector3::UnitZ()).toRotationMatrix();
  object.confidence = 1;
  object.code = held.code;
  return object;
}

Expected<Lift> lift(Cell& cell, const AxisState& start, Time at, const Eigen::Matrix3d& orientation,
                    const Vector3& offset, double peak_m_s2) {
  // Seen from the belt, as it runs and changes speed now, the way is straight: what touches the load is neither pushed
  // nor left to push.
  // A belt that starts or stops gains more than the arm could take up or leave at a stroke: that much goes uncopied.
  double takes_s = std::sqrt(kLeastJerk * offset.norm() / peak_m_s2), rides_s = kRideLifted_s;
  const Vector3 belt = belt_velocity(cell);
  const double loses_most_m_s2 = std::min(kGainsMost_m_s2, belt.x() / takes_s);  // it does not run backwards
  const Vector3 gains(std::clamp(cell.belt_acceleration_m_s2(), -loses_most_m_s2, kGainsMost_m_s2), 0, 0);
  std::array<Vector3, 3> from = tip_motion(cell, start);
  from[1] -= belt;
  from[2] -= gains;
  Expected<motion::Trajectory> way = fail("out of reach", "lift");
  for (int round = 0; round < kRounds && !way; ++round) {
    // An axis may come to its limit: sooner or later it would have to turn back all the way.
    if (round > 0) takes_s *= kSlower, rides_s /= 2;
    const auto above_belt = least_jerk(from, from[0] + offset, takes_s);
    AxisVector seed = start.position;
    const auto path = [&](double t) -> Expected<AxisVector> {
      const double gaining_s = std::min(t, takes_s);
      const Vector3 belt_moved = t * belt + gaining_s * (t - 0.5 * gaining_s) * gains;
      auto q = cell.model.inverse(posed(above_belt(gaining_s) + belt_moved, orientation), seed);
      if (q) seed = *q;
      return q;
    };
    way = motion::follow(start, at, path, takes_s + rides_s, kKnot_s, cell.limits_empty());
  }
  if (!way) return straight_up(cell, start, at, orientation, offset);
  // Whoever takes over does so before that.
  AxisState riding = start;
  const Time end = way->back().end();
  sample(way->back(), end, riding);
  const auto stop = motion::stop(riding, end, cell.limits_empty());
  if (!stop) return std::unexpected(stop.error());
  append(*way, *stop);
  return Lift{std::move(*way), at + from_s(takes_s), end};
}

Expected<Meeting> meet_straight(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                                const std::optional<Eigen::Matrix3d>& orientation) {
  Meeting meeting{.ahead_s = 0.8, .q = start.position};
  for (int round = 0; round < kStraightRounds; ++round) {
    meeting.hover = cell.predict(object, at + from_s(meeting.ahead_s)) + kHover;
    if (round == 0) {
      const auto lean = lean_of(object);
      if (!lean) return std::unexpected(lean.error());
      const auto wanted = orientation ? Expected<Eigen::Matrix3d>(*orientation)
                                      : nearest_orientation(cell, start.position, meeting.hover,
                                                            yaw_of(object.world_from_top.linear()), *lean);
      if (!wanted) return std::unexpected(wanted.error());
      meeting.orientation = *wanted;
    }
    const auto q = cell.model.inverse(posed(meeting.hover, meeting.orientation), meeting.q);
    if (!q) return std::unexpected(q.error());
    meeting.q = *q;
    const auto way = motion::move(start, at, coming_down(cell, *q), covering(cell.limits_empty(), start));
    if (!way) return std::unexpected(way.error());
    meeting.ahead_s = to_s(way->back().end() - at);
  }
  return meeting;
}

namespace {

Expected<Grasp> earliest(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                         const std::optional<Eigen::Matrix3d>& orientation, GraspSearch& search) {
  AxisLimits limits = cell.limits_empty();
  // The way there takes time, in which the parcel rides on: a fixed point that a few rounds find. They begin with the
  // straight way: where the parcel will not be by then, another may.
  const auto straight = meet_straight(cell, start, at, object, orientation);
  if (!straight) return std::unexpected(straight.error());
  Grasp grasp{.orientation = straight->orientation};
  double ahead_s = search.meets ? to_s(*search.meets - at) : straight->ahead_s + search.later_s;
  Expected<motion::Trajectory> way = fail("out of reach", "grasp");
  AxisVector seed = straight->q;
  for (int round = kStraightRounds; round < kRounds; ++round) {
    const Vector3 hover = cell.predict(object, at + from_s(ahead_s)) + kHover;
    const auto q = cell.model.inverse(posed(hover, grasp.orientation), seed);
    if (!q) return std::unexpected(q.error());
    seed = *q;
    way = cell.router.route(start, at, coming_down(cell, *q), nullptr, cell.objects(), limits, &search.known);
    if (!way) {
      if (cell.router.spent()) search.meets = at + from_s(ahead_s);
      if (cell.router.spent() || search.later_s >= kLatest_s) return std::unexpected(way.error());
      // A way round takes longer, and by then what rides behind the parcel is where the parcel was to be met.
      search = {.later_s = search.later_s + kLater_s};
      ahead_s += kLater_s;
      continue;
    }
    const double needed_s = to_s(way->back().end() - at);
    // An arm without a load, too, may be asked for more than its drives have: folded out, all axes at once.
    const double use = torque_use(cell.model, cell.world.robot, Load{}, 0, *way) / kEmptyTorqueShare;
    if (use > 1) limits.acceleration_rad_s2 *= std::max(kBoldest, 1 / use);
    const bool converged = use <= 1 && std::abs(needed_s - ahead_s) < kConverged_s;
    ahead_s = needed_s;
    if (converged) break;
  }
  if (!way) return std::unexpected(way.error());
  grasp.trajectory = std::move(*way);
  grasp.hover = grasp.trajectory.back().end();

  // The last centimetres: straight down on the parcel, ending at the belt's speed.
  const AxisState hovering = motion::sample(grasp.trajectory, grasp.hover, cell.model.axes());
  double down_s = 2 * kHover_m / kComeDown_m_s;
  Expected<motion::Trajectory> down = fail("out of reach", "grasp");
  for (int round = 0; round < kRounds; ++round) {
    grasp.contact_point = cell.predict(object, grasp.hover + from_s(down_s)) - Vector3(0, 0, kPress_m);
    const auto q = cell.model.inverse(posed(grasp.contact_point, grasp.orientation), seed);
    if (!q) return std::unexpected(q.error());
    down = motion::move(hovering, grasp.hover, {*q, joint_speed(cell, *q, belt_velocity(cell))}, limits);
    if (!down) return std::unexpected(down.error());
    const double needed_s = to_s(down->back().end() - grasp.hover);
    const bool converged = std::abs(needed_s - down_s) < kConverged_s;
    down_s = needed_s;
    if (converged) break;
  }
  append(grasp.trajectory, *down);
  grasp.contact = grasp.trajectory.back().end();

  const AxisState touching = motion::sample(grasp.trajectory, grasp.contact, cell.model.axes());
  const auto along = ride(cell, touching, grasp.contact, grasp.orientation, kRide_s);
  if (!along) return std::unexpected(along.error());
  append(grasp.trajectory, *along);
  return grasp;
}

}  // namespace

Expected<Grasp> plan_grasp(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                           const std::optional<Eigen::Matrix3d>& orientation, GraspSearch& search) {
  auto grasp = earliest(cell, start, at, object, orientation, search);
  if (grasp || !cell.router.spent()) search = {};
  return grasp;
}

}  // namespace pons::skills
