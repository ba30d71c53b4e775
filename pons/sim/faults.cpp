#include "pons/sim/faults.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pons/sim/parcels.hpp"

namespace pons::sim {
namespace {

using world::Fault;

// A leak leaves so much of the full vacuum: some too little to count as sealed, some too little for what is heavy.
constexpr double kLeakLeast_kpa = 20, kLeakMost_kpa = 45;
constexpr double kDropsSoonest_s = 0.05, kDropsLatest_s = 1.2;  // after it was lifted; a carry takes about so long
constexpr double kClings_m = 0.03;                              // what lies nearer may cling
constexpr double kPatchLeast = 0.15, kPatchMost = 0.45;         // of the picture's width and height
constexpr int kSteadyCups = 3;                                  // hold what something clings to

template <std::size_t... fault>
std::array<Random, sizeof...(fault)> streams(std::uint64_t seed, std::index_sequence<fault...>) {
  return {world::fault_stream(seed, static_cast<Fault>(fault))...};
}

world::Spells spells(const world::FaultPlan& plan, std::uint64_t seed, Fault fault) {
  return {plan[fault], world::fault_stream(seed, fault).fork(0)};
}

}  // namespace

Faults::Faults(const world::FaultPlan& plan, std::uint64_t seed)
    : plan_(plan),
      seed_(seed),
      streams_(streams(seed, std::make_index_sequence<world::kFaults>())),
      jams_(spells(plan, seed, Fault::kBeltJam)),
      occlusions_(spells(plan, seed, Fault::kOcclusion)),
      blackouts_(spells(plan, seed, Fault::kBlackout)),
      shifts_(spells(plan, seed, Fault::kShiftedView)),
      weak_(spells(plan, seed, Fault::kVacuumWeak)) {}

bool Faults::draws(Fault fault) {
  const double share = plan_[fault].often;
  return share > 0 && streams_[static_cast<std::size_t>(fault)].uniform() < share;
}

void Faults::add_labels(const world::World& world, const world::Manifest& manifest,
                        std::vector<Arrival>& arrivals) const {
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    // A stream of each parcel's own: whether one has room decides nothing about the others.
    Random random = world::fault_stream(seed_, Fault::kDoubleLabel).fork(i);
    if (!(random.uniform() < plan_[Fault::kDoubleLabel].often)) continue;
    if (arrivals[i].label != LabelState::kReadable || !room_for_two_labels(manifest[i], world.arrivals.label_m))
      continue;
    const bool own = manifest.size() < 2 || random.uniform() < 0.5;
    const std::size_t other = (i + 1 + random.below(std::max<std::size_t>(1, manifest.size() - 1))) % manifest.size();
    arrivals[i].second_text = own ? manifest[i].parcel_id : manifest[other].parcel_id;
  }
}

void Faults::begin_attempt(Attempt& attempt) {
  attempt = {.vacuum_on = attempt.vacuum_on};
  attempt.misses = draws(Fault::kMissedGrasp);
  attempt.leaks = draws(Fault::kWeakVacuum);
  attempt.drops = draws(Fault::kDrop);
  if (attempt.leaks)
    attempt.leak_kpa = streams_[static_cast<std::size_t>(Fault::kWeakVacuum)].uniform(kLeakLeast_kpa, kLeakMost_kpa);
  if (attempt.drops)
    attempt.drops_after =
        from_s(streams_[static_cast<std::size_t>(Fault::kDrop)].uniform(kDropsSoonest_s, kDropsLatest_s));
  if (draws(Fault::kDoublePick)) ++owed_doubles_;
}

Suction Faults::suction(std::size_t arm, std::uint32_t vacuum_on, const Gripper& gripper, const Ledger& ledger,
                        Time now) {
  Attempt& attempt = attempts_[arm];
  if (std::exchange(attempt.vacuum_on, vacuum_on) == 0 && vacuum_on != 0) begin_attempt(attempt);
  const bool weak = weak_.on(now);
  Suction suction = vacuum_on == 0 ? Suction{} : attempted(attempt, gripper, ledger, now);
  if (weak) suction.pump = plan_[Fault::kVacuumWeak].share;
  return suction;
}

// By what was drawn for this attempt.
Suction Faults::attempted(Attempt& attempt, const Gripper& gripper, const Ledger& ledger, Time now) {
  const int slot = gripper.touched();
  if (attempt.misses) {
    if (slot >= 0 && !std::exchange(attempt.missed, true)) ++counts_[Fault::kMissedGrasp];
    return {.seals = false};
  }
  if (slot >= 0 && ledger.lifted(slot)) {
    if (!attempt.lifted) attempt.lifted = now;
    if (attempt.drops && now >= *attempt.lifted + attempt.drops_after && !std::exchange(attempt.dropped, true))
      ++counts_[Fault::kDrop];
  }
  if (attempt.dropped) return {.seals = false};
  if (!attempt.leaks) return {};
  if (slot >= 0 && !std::exchange(attempt.leaked, true)) ++counts_[Fault::kWeakVacuum];
  return {.sealed_kpa = attempt.leak_kpa};
}

// The nearest that lies on the belt beside it; -1: none is near.
int Faults::neighbour(const Composed& cell, mjData* data, int slot, const Ledger& ledger) const {
  int nearest = -1;
  double least_m = kClings_m;
  for (int other = 0; other < kSlots; ++other) {
    if (other == slot || !ledger.on_belt(other)) continue;
    double between[6];
    const double apart_m = mj_geomDistance(cell.model.get(), data, cell.slots[static_cast<std::size_t>(slot)].main,
                                           cell.slots[static_cast<std::size_t>(other)].main, kClings_m, between);
    if (apart_m < least_m) least_m = apart_m, nearest = other;
  }
  return nearest;
}

// What a gripper has hold of and has not lifted yet; -1: none.
int Faults::newly_held(std::span<const ArmStep> arms, const Ledger& ledger) const {
  for (const ArmStep& arm : arms) {
    const int held = arm.gripper.touched();
    if (held >= 0 && arm.gripper.grip(held) >= kSteadyCups && !ledger.lifted(held)) return held;
  }
  return -1;
}

// Tape, a flap or film that hooks: the two stay as they lie to each other, until the first is let go of.
void Faults::cling(Composed& cell, mjData* data, std::span<const ArmStep> arms, const Ledger& ledger) {
  if (cell.cling < 0) return;
  if (clings_to_ >= 0) {
    const bool held = std::ranges::any_of(arms, [&](const ArmStep& arm) { return arm.gripper.grip(clings_to_) > 0; });
    if (held && ledger.parcel_in(clings_) >= 0) return;
    data->eq_active[cell.cling] = 0;
    wake(data, cell.slots[static_cast<std::size_t>(clings_)]);
    clings_to_ = clings_ = -1;
    return;
  }
  const int held = owed_doubles_ == 0 ? -1 : newly_held(arms, ledger);
  if (held < 0) return;
  const int beside = neighbour(cell, data, held, ledger);
  if (beside < 0) return;
  --owed_doubles_;
  ++counts_[Fault::kDoublePick];
  clings_to_ = held, clings_ = beside;
  mjModel* const model = cell.model.get();
  const Slot &one = cell.slots[static_cast<std::size_t>(held)], &two = cell.slots[static_cast<std::size_t>(beside)];
  const Pose one_from_two = from_mujoco(data->qpos + one.qpos, data->qpos + one.qpos + 3).inverse() *
                            from_mujoco(data->qpos + two.qpos, data->qpos + two.qpos + 3);
  model->eq_obj1id[cell.cling] = one.body;
  model->eq_obj2id[cell.cling] = two.body;
  mjtNum* const weld = model->eq_data + mjNEQDATA * cell.cling;
  std::fill_n(weld, 3, 0.0);  // the second body's own origin is what is held
  to_mujoco(one_from_two, weld + 3, weld + 6);
  weld[10] = 1;
  data->eq_active[cell.cling] = 1;
  wake(data, two);
}

Sight Faults::sight(Time now) {
  Sight sight;
  sight.black = blackouts_.on(now);
  if (occlusions_.on(now)) {
    if (std::exchange(hidden_by_, occlusions_.begun()) != occlusions_.begun()) {
      Random& random = streams_[static_cast<std::size_t>(Fault::kOcclusion)];
      const double width = random.uniform(kPatchLeast, kPatchMost), height = random.uniform(2 * kPatchLeast, 1);
      const double left = random.uniform(0, 1 - width), top = random.uniform(0, 1 - height);
      patch_ = {left, top, left + width, top + height};
    }
    sight.hidden = patch_;
  }
  if (shifts_.on(now)) {
    if (std::exchange(shifted_by_, shifts_.begun()) != shifts_.begun()) {
      const double angle = streams_[static_cast<std::size_t>(Fault::kShiftedView)].uniform(0, 2 * std::numbers::pi);
      shift_m_ = plan_[Fault::kShiftedView].by_m * Vector3(std::cos(angle), std::sin(angle), 0);
    }
    sight.shift_m = shift_m_;
  }
  return sight;
}

world::FaultCounts Faults::counts() const {
  world::FaultCounts counts = counts_;
  counts[Fault::kBeltJam] = jams_.begun();
  counts[Fault::kOcclusion] = occlusions_.begun();
  counts[Fault::kBlackout] = blackouts_.begun();
  counts[Fault::kShiftedView] = shifts_.begun();
  counts[Fault::kVacuumWeak] = weak_.begun();
  return counts;
}

}  // namespace pons::sim
