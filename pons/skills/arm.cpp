#include "pons/skills/arm.hpp"

#include <algorithm>

namespace pons::skills {
namespace {

constexpr std::size_t kSentRemembered = 64;  // until somebody asks
constexpr Duration kSpliceStep = std::chrono::milliseconds(5);
// Of an arm that is brought in from outside its limits: so slowly, so far inside, and at rest so long before it is
// asked where it stands.
constexpr double kRecoverySpeed = 0.05, kInside_rad = 0.02;
constexpr Duration kSurelyOff = std::chrono::milliseconds(30);  // after the body's watchdog: some ticks of the bridge
constexpr Duration kRecoveredRest = std::chrono::milliseconds(200);

std::int64_t tick_of(Time time) { return time.ns() / std::chrono::nanoseconds(std::chrono::milliseconds(1)).count(); }

}  // namespace

Arm::Arm(link::BridgeEnd& link, const world::World& world, Duration splice_lead)
    : link_(link),
      world_(world),
      splice_lead_(splice_lead + from_s(world.robot.drive_delay_s)),
      unheard_(from_s(world.robot.watchdog_s) + kSurelyOff),
      rest_(at_rest(world.robot.home)) {}

void Arm::refresh(Time now) {
  now_ = now;
  link_.latest(state_);
  listen(now);
  if (state_.safety != safety_before_ || state_.controller != controlled_before_) {
    // After a stop the arm is where it came to rest, whatever was planned; after it gave way, where that brought it.
    asked_.clear();
    rest_ = at_rest(state_.commanded.position.size() > 0 ? state_.commanded.position : world_.robot.home);
    const bool armed = operational() && safety_before_ != link::SafetyState::kOperational;
    safety_before_ = state_.safety;
    controlled_before_ = state_.controller;
    if (armed && contact_n_ > 0) send({.kind = link::CommandKind::kContact, .contact_n = contact_n_});
  }
  // Segments that ended are history; the last one says where the arm rests.
  const Time reached = now - late();
  const auto live = std::find_if(asked_.begin(), asked_.end(), [&](const Segment& s) { return s.end() >= reached; });
  if (live == asked_.end()) {
    if (!asked_.empty()) asked_.erase(asked_.begin(), asked_.end() - 1);
  } else {
    asked_.erase(asked_.begin(), live);
  }
  send({.kind = link::CommandKind::kHeartbeat});
}

// One that counts from the beginning is another, and knows nothing of what hangs on the cups.
void Arm::listen(Time now) {
  if (state_.tick != heard_tick_) {
    if (state_.tick < heard_tick_ && !state_.vacuum.open) tell_payload();
    heard_tick_ = state_.tick;
    heard_ = now;
  }
  if (heard_tick_ > 0 && now - heard_ >= unheard_) state_.safety = link::SafetyState::kDisarmed;
}

AxisState Arm::planned(Time time) const {
  if (asked_.empty()) return rest_;
  return motion::sample(asked_, time - late(), rest_.position.size());
}

Time Arm::motion_end() const { return asked_.empty() ? Time{} : asked_.back().end() + late(); }

Time Arm::splice_time(Time now, const AxisLimits& limits) const {
  Time from = splice_time(now);
  for (; from < motion_end(); from += kSpliceStep) {
    const AxisState state = planned(from);
    if ((state.acceleration.cwiseAbs().array() <= limits.acceleration_rad_s2.array()).all()) break;
  }
  return from;
}

Expected<void> Arm::stream(const motion::Trajectory& trajectory) {
  // Half a motion would end moving, so all of it goes or nothing.
  if (link_.room() < trajectory.size()) {
    return fail("the link to the cerebellum is full", "arm", "the loop has stopped taking commands");
  }
  bool first = true;
  for (Segment segment : trajectory) {
    segment.start = segment.start - late();
    if (first) {
      const Time start = segment.start;
      std::erase_if(asked_, [&](const Segment& s) { return s.start >= start; });
      if (!asked_.empty() && asked_.back().end() > start) asked_.back().duration = start - asked_.back().start;
    }
    send({.kind = link::CommandKind::kMotion, .splice = first, .segment = segment});
    asked_.push_back(segment);
    first = false;
  }
  if (sent_.size() == kSentRemembered) sent_.erase(sent_.begin());
  if (!trajectory.empty()) sent_.push_back({tick_of(trajectory.front().start), tick_of(trajectory.back().end())});
  return {};
}

Expected<void> Arm::stop(Time now) {
  const Time from = splice_time(now);
  auto trajectory = motion::stop(planned(from), from, world_.robot.limits);
  if (!trajectory) return std::unexpected(trajectory.error());
  return stream(*trajectory);
}

void Arm::vacuum(bool on) {
  const std::uint32_t all = (1U << world_.robot.tool.cups_m.size()) - 1U;
  send({.kind = link::CommandKind::kVacuum, .vacuum_on = on ? all : 0U});
}

void Arm::payload(double mass_kg, const Vector3& com_in_flange_m) {
  payload_kg_ = mass_kg;
  payload_com_m_ = com_in_flange_m;
  tell_payload();
}

void Arm::tell_payload() {
  send({.kind = link::CommandKind::kPayload,
        .payload_kg = payload_kg_,
        .payload_com_m = {payload_com_m_.x(), payload_com_m_.y(), payload_com_m_.z()}});
}

void Arm::expect_contact(double force_n) {
  if (force_n == contact_n_) return;
  contact_n_ = force_n;
  if (operational()) send({.kind = link::CommandKind::kContact, .contact_n = force_n});
}

void Arm::belt(link::Belt wanted) {
  if (operational() && state_.belt != wanted) send({.kind = link::CommandKind::kBelt, .belt = wanted});
}

void Arm::control(link::Controller controller, const link::Compliance& compliance) {
  send({.kind = link::CommandKind::kControl, .controller = controller, .compliance = compliance});
}

void Arm::arm(Time) {
  if (state_.safety == link::SafetyState::kProtectiveStop || state_.safety == link::SafetyState::kEmergencyStop) {
    send({.kind = link::CommandKind::kReset});
  } else if (state_.safety == link::SafetyState::kDisarmed) {
    send({.kind = link::CommandKind::kArm});
  }
}

double Arm::outside_rad() const {
  const AxisLimits& limits = world_.robot.limits;
  if (state_.position.size() != limits.position_min.size()) return 0;
  return std::max(
      {0.0, (limits.position_min - state_.position).maxCoeff(), (state_.position - limits.position_max).maxCoeff()});
}

Expected<void> Arm::recover(Time now) {
  if (state_.safety != link::SafetyState::kRecovery) {
    if (state_.safety == link::SafetyState::kDisarmed)
      send({.kind = link::CommandKind::kRecover});
    else
      arm(now);
    return {};
  }
  if (now < motion_end() + kRecoveredRest) return {};
  if (outside_rad() <= 0) {
    send({.kind = link::CommandKind::kReset});
    return {};
  }
  const Time from = splice_time(now);
  AxisLimits slow = world_.robot.limits;
  AxisVector inside = state_.commanded.position;  // but for those axes that are outside
  for (Eigen::Index i = 0; i < inside.size(); ++i) {
    const double low = slow.position_min[i], high = slow.position_max[i];
    if (std::min(inside[i], state_.position[i]) < low) inside[i] = low + kInside_rad;
    if (std::max(inside[i], state_.position[i]) > high) inside[i] = high - kInside_rad;
  }
  slow.position_min = slow.position_min.cwiseMin(state_.commanded.position);
  slow.position_max = slow.position_max.cwiseMax(state_.commanded.position);
  slow.speed_rad_s *= kRecoverySpeed;
  slow.acceleration_rad_s2 *= kRecoverySpeed;
  slow.jerk_rad_s3 *= kRecoverySpeed;
  auto way = motion::move(at_rest(state_.commanded.position), from, {inside, AxisVector::Zero(inside.size())}, slow);
  if (!way) return std::unexpected(way.error());
  return stream(*way);
}

bool Arm::send(link::Command command) {
  command.sequence = ++sequence_;
  command.epoch = state_.epoch;
  if (!link_.send(command)) return false;
  if (show_sent_ && command.kind != link::CommandKind::kHeartbeat) show_sent_(now_, command);
  return true;
}

}  // namespace pons::skills
