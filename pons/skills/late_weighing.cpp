#include "pons/skills/late_weighing.hpp"

#include <algorithm>

#include "pons/skills/grasp.hpp"

namespace pons::skills {
namespace {

constexpr double kFree_m = 0.06;     // between a load and the belt: it may hang lower than its size says
constexpr double kFreed_m_s2 = 2.5;  // lifted so softly, it hardly swings
constexpr Duration kWeighAtMost = std::chrono::milliseconds(600);

double free_m(const Cell& cell, const Pose& tip) {
  return tip.translation().z() - cell.held->load.size_m.z() - cell.world.belt.surface_z_m;
}

}  // namespace

bool LateWeighing::tick(Time now) {
  if (lets_go_) {
    const auto laid = set_down_.tick(now);
    lets_go_ = laid && !*laid;
    return !lets_go_;
  }
  if (!cell_.held || cell_.held->mass_kg > 0 || cell_.loses_load()) return true;
  cell_.hold_belt(now);  // or what rides along comes against it, and bears a part of it
  const Pose tip = cell_.model.world_from_tip(cell_.arm.planned(cell_.arm.splice_time(now)).position);
  if (!rested_) lift_free(now);
  if (free_m(cell_, tip) < kFree_m && never_lifted(cell_, weigh_now(cell_))) {
    set_down_.begin_here(now, tip.translation().z());
    lets_go_ = true;
    return false;
  }
  if (now < *rested_) return false;
  scale_.add(cell_);
  const double most_kg = cell_.world.rules.max_mass_kg;
  const std::optional<Weight> weighed = scale_.weigh(cell_, most_kg);
  if (!weighed && now < *rested_ + kWeighAtMost) return false;
  Held& held = *cell_.held;
  held.alone = held.alone || (weighed && !hangs_beside(held.load, *weighed, held.company, std::nullopt));
  const bool free = free_m(cell_, tip) >= kFree_m / 2;
  cell_.weighs(weighed && free ? std::max(kLightest_kg, weighed->mass_kg) : most_kg);
  rested_.reset();
  return true;
}

void LateWeighing::lift_free(Time now) {
  rested_ = now;
  scale_ = {};
  const Time from = cell_.arm.splice_time(now);
  const AxisState state = cell_.arm.planned(from);
  const Pose tip = cell_.model.world_from_tip(state.position);
  if (free_m(cell_, tip) >= kFree_m) return;
  const auto up = lift(cell_, state, from, tip.linear(), lift_offset(cell_, held_at(*cell_.held, tip)), kFreed_m_s2);
  if (up && cell_.arm.stream(up->trajectory)) rested_ = up->top;
}

}  // namespace pons::skills
