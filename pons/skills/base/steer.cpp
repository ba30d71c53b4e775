#include "pons/skills/base/steer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace pons::skills {
namespace {

constexpr Duration kPiece = std::chrono::milliseconds(20);
constexpr int kPieces = 60;  // then the motion brakes to rest
// Of the wheels' limits for going ahead; the rest is for turning.
constexpr double kAheadShare = 0.5;
constexpr double kTrueShare = 0.96;     // of the base's speed limit: its wheels may be larger than drawn
constexpr double kKept = 0.98;          // of each limit: pieces are rounded
constexpr double kOnTheSpot_rad = 0.6;  // where the way lies so far aside, it turns before it drives,
constexpr double kAligned_rad = 0.15;   // until the way lies ahead
constexpr double kStands_m_s = 0.03, kStands_rad_s = 0.05;
constexpr double kBackwards_m = 0.25;  // what lies so near behind it, it backs to
constexpr double kThere_m = 0.008, kThere_rad = 0.006;
constexpr double kBrake = 0.45;        // of the limit, where it slows for the end: the end moves with each scan
constexpr double kSettles_1_s = 2.5;   // how fast the last of a way, or of an angle, is closed
constexpr double kSlowest_m_s = 0.12;  // by what is near
constexpr double kShortestLook_m = 0.12;
constexpr int kHeldPieces = 15;
constexpr double kCreeps_m_s = 0.1, kCreeps_rad_s = 0.4;
constexpr Duration kLook = std::chrono::milliseconds(20);

double clamped(double value, double most) { return std::clamp(value, -most, most); }

// The acceleration that brings `value` to `wanted` and ends there, as fast as acceleration and jerk allow when it is
// chosen anew every dt.
double towards(double wanted, double value, double rate, double most, double jerk, double dt_s) {
  const double left = wanted - value;
  const double step = jerk * dt_s;
  const double best = std::copysign(std::sqrt(step * step + 2 * jerk * std::abs(left)) - step, left);
  return rate + clamped(clamped(best, most) - rate, step);
}

}  // namespace

DriveLimits drive_limits(const world::Base& base, const AxisLimits& wheels) {
  const double r = base.wheel_radius_m, half_track = base.track_m / 2;
  const double acceleration = kKept * wheels.acceleration_rad_s2.minCoeff() * r;
  const double jerk = kKept * wheels.jerk_rad_s3.minCoeff() * r;
  return {.ahead_m_s = kTrueShare * base.speed_m_s,
          .ahead_m_s2 = kAheadShare * acceleration,
          .ahead_m_s3 = kAheadShare * jerk,
          .turn_rad_s = base.turn_rad_s,
          .turn_rad_s2 = (1 - kAheadShare) * acceleration / half_track,
          .turn_rad_s3 = (1 - kAheadShare) * jerk / half_track};
}

Steer::Steer(const Floor& floor, const world::Base& base, const AxisLimits& wheels)
    : floor_(floor), drive_(base), wheel_limits_(wheels), limits_(drive_limits(base, wheels)) {}

void Steer::follow(Way way, double end_yaw) {
  way_ = std::move(way);
  end_yaw_ = end_yaw;
}

std::optional<Steered> Steer::look_ahead(const Rolling& start, Time at) {
  static constexpr std::array kManners{Manner{1.0, 0.45}, Manner{0.7, 0.30}, Manner{0.5, 0.20}, Manner{0.3, 0.15},
                                       Manner{0.0, 0.15}};
  for (const Manner& manner : kManners) {
    if (auto steered = try_out(start, at, manner)) return steered;
  }
  return std::nullopt;
}

std::optional<Steered> Steer::try_out(const Rolling& start, Time at, const Manner& manner) const {
  Thought thought{.pose = start.map_from_base,
                  .speed = drive_.twist(start.wheels.speed),
                  .rate = drive_.twist(start.wheels.acceleration)};
  AxisState wheels = start.wheels;
  Steered steered;
  for (int i = 0; i < kPieces && !(steered.arrives = is_done(thought)); ++i) {
    Segment piece{.start = at + i * kPiece, .duration = kPiece};
    step(thought, wish(thought, manner), wheels, piece);
    steered.wheels.push_back(piece);
  }
  const Time end = steered.wheels.empty() ? at : steered.wheels.back().end();
  const auto rest = motion::stop(wheels, end, wheel_limits_);
  if (!rest) return std::nullopt;
  steered.wheels.insert(steered.wheels.end(), rest->begin(), rest->end());
  if (!has_room(start, steered.wheels)) return std::nullopt;
  return steered;
}

std::optional<motion::Trajectory> Steer::hold(const Rolling& start, Time at, const model::Twist2& wished,
                                              Room room) const {
  const bool known = room == Room::kKnown;
  const model::Twist2 most{known ? limits_.ahead_m_s : kCreeps_m_s, known ? limits_.turn_rad_s : kCreeps_rad_s};
  for (const double share : {1.0, 0.7, 0.4, 0.2, 0.0}) {
    const model::Twist2 held{share * clamped(wished.ahead, most.ahead), clamped(wished.turn, most.turn)};
    Thought thought{.pose = start.map_from_base,
                    .speed = drive_.twist(start.wheels.speed),
                    .rate = drive_.twist(start.wheels.acceleration)};
    AxisState wheels = start.wheels;
    motion::Trajectory trajectory;
    for (int i = 0; i < kHeldPieces; ++i) {
      Segment piece{.start = at + i * kPiece, .duration = kPiece};
      step(thought, held, wheels, piece);
      trajectory.push_back(piece);
    }
    const auto rest = motion::stop(wheels, trajectory.back().end(), wheel_limits_);
    if (!rest) return std::nullopt;
    trajectory.insert(trajectory.end(), rest->begin(), rest->end());
    if (!known || has_room(start, trajectory)) return trajectory;
  }
  return std::nullopt;
}

// Where there is too little room already, it may leave: what counts is that it gets no closer.
bool Steer::has_room(const Rolling& start, const motion::Trajectory& wheels) const {
  const double least = std::min(floor_.needed_m(), floor_.clearance_m(start.map_from_base.position()) - 1e-3);
  Pose2 pose = start.map_from_base;
  AxisVector before = start.wheels.position;
  for (Time at = wheels.front().start; at < wheels.back().end();) {
    at = std::min(at + kLook, wheels.back().end());
    const AxisVector after = motion::sample(wheels, at, before.size()).position;
    pose = drive_.rolled(pose, before, after);
    before = after;
    if (floor_.clearance_m(pose.position()) < least) return false;
  }
  return true;
}

bool Steer::is_done(const Thought& thought) const {
  return (way_.back() - thought.pose.position()).norm() < 3 * kThere_m &&
         std::abs(wrapped(end_yaw_ - thought.pose.yaw)) < kThere_rad && std::abs(thought.speed.ahead) < 0.005 &&
         std::abs(thought.speed.turn) < 0.02;
}

model::Twist2 Steer::turn_to(const Thought& thought, double yaw) const {
  const double left = wrapped(yaw - thought.pose.yaw);
  const double most = std::min(limits_.turn_rad_s, std::sqrt(2 * kBrake * limits_.turn_rad_s2 * std::abs(left)));
  return {0, clamped(kSettles_1_s * left, most)};
}

double Steer::speed_here(const Thought& thought) const {
  const double room = floor_.clearance_m(thought.pose.position()) - floor_.needed_m();
  const double free = floor_.comfortable_m() - floor_.needed_m();
  return std::max(kSlowest_m_s, limits_.ahead_m_s * std::clamp(room / free, 0.0, 1.0));
}

model::Twist2 Steer::wish(Thought& thought, const Manner& manner) const {
  const Vector2 here = thought.pose.position();
  // The way's nearest point from the leg on that it has reached; behind that, how much is left.
  const auto nearest_on = [&](std::size_t leg) {
    const Vector2 along = way_[leg + 1] - way_[leg];
    const double share = along.squaredNorm() < 1e-12 ? 1 : (here - way_[leg]).dot(along) / along.squaredNorm();
    return Vector2(way_[leg] + std::clamp(share, 0.0, 1.0) * along);
  };
  Vector2 nearest = nearest_on(thought.leg);
  for (std::size_t leg = thought.leg + 1; leg + 1 < way_.size(); ++leg) {
    const Vector2 other = nearest_on(leg);
    if ((other - here).norm() > (nearest - here).norm()) continue;
    nearest = other;
    thought.leg = leg;
  }
  Vector2 target = nearest;
  double look = std::max(kShortestLook_m, manner.look_m), left_m = 0;
  for (std::size_t leg = thought.leg + 1; leg < way_.size(); ++leg) {
    const Vector2 from = leg == thought.leg + 1 ? nearest : way_[leg - 1];
    const double length = (way_[leg] - from).norm();
    left_m += length;
    if (look > 0) target = from + (way_[leg] - from) * std::min(1.0, length < 1e-9 ? 1.0 : look / length);
    look -= length;
  }
  const double goal_m = (way_.back() - here).norm();
  if (goal_m < kThere_m || (left_m < kThere_m && goal_m < 3 * kThere_m)) return turn_to(thought, end_yaw_);

  const Vector2 to = target - here;
  const double bearing = std::atan2(to.y(), to.x());
  double aside = wrapped(bearing - thought.pose.yaw);
  const bool backwards = goal_m < kBackwards_m && std::abs(aside) > std::numbers::pi / 2;
  if (backwards) aside = wrapped(aside + std::numbers::pi);
  const bool stands = std::abs(thought.speed.ahead) < kStands_m_s;
  const bool turns = std::abs(thought.speed.turn) > kStands_rad_s;
  const double most_aside = stands ? (turns ? kAligned_rad : 2 * kAligned_rad) : kOnTheSpot_rad;
  if (std::abs(aside) > most_aside) return turn_to(thought, thought.pose.yaw + aside);

  const double curvature = 2 * std::sin(aside) / std::max(to.norm(), kShortestLook_m);
  double speed =
      std::min({manner.speed_share * limits_.ahead_m_s, speed_here(thought), kSettles_1_s * std::max(left_m, goal_m),
                std::sqrt(2 * kBrake * limits_.ahead_m_s2 * std::max(left_m, goal_m))});
  if (std::abs(curvature) > 1e-6) speed = std::min(speed, 0.7 * limits_.turn_rad_s / std::abs(curvature));
  const double turn = clamped(std::abs(thought.speed.ahead) * curvature, limits_.turn_rad_s);
  return {backwards ? -speed : speed, turn};
}

// One piece of constant jerk.
void Steer::step(Thought& thought, const model::Twist2& wished, AxisState& wheels, Segment& piece) const {
  const double dt = to_s(kPiece);
  const double ahead =
      towards(wished.ahead, thought.speed.ahead, thought.rate.ahead, limits_.ahead_m_s2, limits_.ahead_m_s3, dt);
  const double turn =
      towards(wished.turn, thought.speed.turn, thought.rate.turn, limits_.turn_rad_s2, limits_.turn_rad_s3, dt);
  const model::Twist2 jerk{(ahead - thought.rate.ahead) / dt, (turn - thought.rate.turn) / dt};
  const std::array<double, 2> jerks{drive_.left(jerk), drive_.right(jerk)};
  const AxisVector before = wheels.position;
  for (Eigen::Index i = 0; i < 2; ++i) {
    auto& c = piece.coefficients[static_cast<std::size_t>(i)];
    c = {wheels.position[i], wheels.speed[i], wheels.acceleration[i] / 2, jerks[static_cast<std::size_t>(i)] / 6, 0, 0};
  }
  sample(piece, piece.end(), wheels);
  thought.pose = drive_.rolled(thought.pose, before, wheels.position);
  thought.speed = drive_.twist(wheels.speed);
  thought.rate = {ahead, turn};
}

}  // namespace pons::skills
