#include "pons/skills/base/chassis.hpp"

#include <algorithm>
#include <cmath>

namespace pons::skills {
namespace {

constexpr Duration kRemembered = std::chrono::seconds(2);  // no scan is longer on its way
constexpr Duration kStep = std::chrono::milliseconds(10);
// So unsure, or with so little of a scan on the map, the base may be anywhere.
constexpr double kSure_m = 0.10, kSure_rad = 0.10, kSureShare = 0.4;
// So long after it was due without it, a scan no longer shows what is around: a base has driven a quarter of a metre.
constexpr Duration kSeesFor = std::chrono::milliseconds(500);

}  // namespace

Chassis::Chassis(link::BridgeEnd& link, const world::World& the_world, Duration splice_lead)
    : world(the_world),
      drive(*the_world.base),
      wheels(link, the_world, splice_lead),
      floor(*the_world.map, *the_world.base),
      map_from_base_(the_world.base->start) {}

void Chassis::refresh(Time now) {
  now_ = now;
  wheels.refresh(now);
  floor.forget_until(now);
  const link::State& state = wheels.state();
  if (state.position.size() != 2 || (!turned_.empty() && turned_.back().stamp >= state.stamp)) return;
  if (!turned_.empty()) map_from_base_ = drive.rolled(map_from_base_, turned_.back().wheels_rad, state.position);
  odometry_.take(state.position);
  turned_.push_back({state.stamp, state.position});
  while (turned_.front().stamp + kRemembered < now) turned_.pop_front();
}

void Chassis::locate(const BaseBelief& belief) {
  belief_ = belief;
  map_from_base_ = belief.map_from_base;
  const AxisVector* before = &belief_->wheels_rad;
  for (const Turned& after : turned_) {
    if (after.stamp <= belief.stamp) continue;
    map_from_base_ = drive.rolled(map_from_base_, *before, after.wheels_rad);
    before = &after.wheels_rad;
  }
  floor.see(belief);
}

bool Chassis::sees() const {
  return belief_ && now_ - belief_->stamp <= from_s(world.cameras.front().latency_s) + kSeesFor;
}

bool Chassis::sure() const {
  if (!sees()) return false;
  const Eigen::Matrix3d& c = belief_->covariance;
  return std::sqrt(std::max(c(0, 0), c(1, 1))) < kSure_m && std::sqrt(c(2, 2)) < kSure_rad &&
         (belief_->returns == 0 || belief_->matched > kSureShare);
}

Rolling Chassis::expected(Time at) const {
  Rolling rolling{map_from_base_, wheels.planned(at)};
  if (turned_.empty()) return rolling;
  Time time = turned_.back().stamp;
  AxisVector before = wheels.planned(time).position;
  while (time < at) {
    time = std::min(time + kStep, at);
    const AxisVector after = wheels.planned(time).position;
    rolling.map_from_base = drive.rolled(rolling.map_from_base, before, after);
    before = after;
  }
  return rolling;
}

}  // namespace pons::skills
