#include "tests/system/hand.hpp"

#include "pons/motion/motion.hpp"
#include "tests/system/plant.hpp"

namespace pons::tests {
namespace {

using skills::Cell;

constexpr double kRise_m = 0.30, kOverBelt_m = 0.03;
constexpr Duration kSettles = std::chrono::milliseconds(30);       // after the end of a motion
constexpr Duration kLeftAlone = std::chrono::milliseconds(500);    // then nobody wants what is held
constexpr Duration kCalledEvery = std::chrono::milliseconds(100);  // at least, or it begins anew

}  // namespace

bool Hand::go(Time now, const Vector3& to) {
  const Time from = cell_.arm.splice_time(now);
  const AxisState state = cell_.arm.planned(from);
  const auto q = cell_.model.inverse(Cell::tip_down(to, 0), state.position, model::Among::kAllBranches);
  if (!q) return false;
  const auto way = motion::move(state, from, {*q, AxisVector::Zero(q->size())}, cell_.limits_planned());
  if (!way) return false;
  (void)steps_.at(Act::kMotion, Moment::kBefore);
  const bool sent = cell_.arm.stream(*way).has_value();
  (void)steps_.at(Act::kMotion, Moment::kAfter);
  return sent;
}

// As far as the arm gets: right above where a stop came it may have no pose.
bool Hand::rise(Time now) {
  const AxisState state = cell_.arm.planned(cell_.arm.splice_time(now));
  const Vector3 tip = cell_.model.world_from_tip(state.position).translation();
  const double by_m = cell_.world.belt.surface_z_m + kParcelHeight_m + kRise_m - tip.z();
  for (const double share : {1.0, 0.5, 0.25})
    if (go(now, tip + share * by_m * Vector3::UnitZ())) return true;
  return false;
}

bool Hand::arrived(Time now) const { return now >= cell_.arm.motion_end() + kSettles; }

void Hand::vacuum(bool on) {
  (void)steps_.at(Act::kCups, Moment::kBefore);
  cell_.arm.vacuum(on);
  (void)steps_.at(Act::kCups, Moment::kAfter);
}

void LayDown::tick(Time now) {
  if (now > last_ + kCalledEvery || !cell_.arm.operational()) phase_ = Phase::kRise, since_ = now + kLeftAlone;
  last_ = now;
  if (!cell_.arm.operational() || now < since_ || !hand_.arrived(now)) return;
  if (cell_.arm.cups().phase == link::VacuumPhase::kLost) phase_ = Phase::kLetGo;  // there is nothing to lay down
  const world::Belt& belt = cell_.world.belt;
  Vector3 spot(0.5 * (belt.pick_x_min_m + belt.pick_x_max_m), belt.y_center_m, belt.surface_z_m + kParcelHeight_m);
  switch (phase_) {
    case Phase::kRise:
      (void)hand_.rise(now);  // or straight there, where no pose is right above
      phase_ = Phase::kCarry;
      return;
    case Phase::kCarry:
      spot.z() += kRise_m;
      if (hand_.go(now, spot)) phase_ = Phase::kLower;
      return;
    case Phase::kLower:
      spot.z() += kOverBelt_m;
      if (hand_.go(now, spot)) phase_ = Phase::kLetGo;
      return;
    case Phase::kLetGo:
      if (cell_.arm.state().vacuum_on != 0) hand_.vacuum(false);
      if (cell_.arm.cups().open && cell_.arm.state().vacuum_on == 0) {
        cell_.holds_nothing();
        phase_ = Phase::kRise;
      }
      return;
  }
}

}  // namespace pons::tests
