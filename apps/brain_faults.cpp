#include "apps/brain_faults.hpp"

namespace pons::apps {

using world::Fault;

BrainFaults::BrainFaults(const world::FaultPlan& plan, std::uint64_t seed) {
  const auto spells = [&](Fault fault) { return world::Spells(plan[fault], world::fault_stream(seed, fault)); };
  const auto stream = [&](Fault fault) { return world::fault_stream(seed, fault).fork(1); };
  if (plan[Fault::kBrainStall].often > 0) stalls = spells(Fault::kBrainStall);
  if (plan[Fault::kBrainLie].often > 0) lies.emplace(plan[Fault::kBrainLie], stream(Fault::kBrainLie));
  if (plan[Fault::kNetworkLoss].often > 0) network.emplace(spells(Fault::kNetworkLoss), stream(Fault::kNetworkLoss));
}

void BrainFaults::count(world::FaultCounts& counts) const {
  if (stalls) counts[Fault::kBrainStall] = stalls->begun();
  if (lies) counts[Fault::kBrainLie] = lies->count();
  if (network) counts[Fault::kNetworkLoss] = network->spells();
}

}  // namespace pons::apps
