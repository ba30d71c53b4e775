// Faults of the brain, and between it and the bridge (docs/decisions/0029-faults-as-data.md), of a whole run.
#pragma once

#include <cstdint>
#include <optional>

#include "pons/brain/far_brain.hpp"
#include "pons/brain/liar.hpp"
#include "pons/world/faults.hpp"

namespace pons::apps {

// Each where the plan has it. They outlive the bridges, and the brains beside them.
struct BrainFaults {
  BrainFaults(const world::FaultPlan& plan, std::uint64_t seed);
  // How often each was injected.
  void count(world::FaultCounts& counts) const;

  std::optional<world::Spells> stalls;
  std::optional<brain::Lies> lies;
  std::optional<brain::Network> network;
};

}  // namespace pons::apps
