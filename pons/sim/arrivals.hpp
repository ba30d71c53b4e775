// How each parcel of a manifest arrives: drawn from (seed, index) alone, so it does not depend on timing. Private to
// pons/sim.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

enum class LabelState : std::uint8_t { kReadable, kDown, kDamaged, kUnknownCode };

struct Arrival {
  int group = 0;  // parcels of one group are put down together; groups count up
  Pose group_from_middle =
      Pose::Identity();  // the parcel's middle; x along the belt, z = 0 on the belt, x = 0 the group's front
  bool touching = false;
  LabelState label = LabelState::kReadable;
  std::string label_text;
  std::string second_text;               // of a second label beside it; empty: it has none
  std::array<double, 2> label_offset{};  // -1 … 1 of the room on the top face
  int label_turn = 0;                    // quarter turns
  std::array<float, 3> color{};
  double mass_kg = 0;         // real
  double gap_m = 0;           // free belt behind its group
  double group_length_m = 0;  // along the belt
};

// One entry a manifest row.
[[nodiscard]] std::vector<Arrival> plan_arrivals(const world::World& world, const world::Manifest& manifest,
                                                 std::uint64_t seed);

}  // namespace pons::sim
