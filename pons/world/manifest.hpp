// What is to be sorted: read from a CSV file or drawn from a seed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"
#include "pons/world/world.hpp"

namespace pons::world {

enum class ParcelKind : std::uint8_t { kBox, kMailer, kTube, kBag };
[[nodiscard]] std::string_view name(ParcelKind kind);

// One row. The label carries `parcel_id`.
struct ManifestRow {
  std::string parcel_id;
  std::string destination;  // a chute's name
  ParcelKind kind = ParcelKind::kBox;
  Vector3 size_m = Vector3::Zero();  // length, width, height
  double mass_kg = 0;
  int priority = 0;         // 0 … 100; express is 80 and above
};

using Manifest = std::vector<ManifestRow>;

// Columns parcel_id,destination,kind,length_m,width_m,height_m,mass_kg,priority in any order, UTF-8, at most 1 MiB a
// line and 1,000,000 rows. Errors name file, line and column.
[[nodiscard]] Expected<Manifest> read_manifest(const std::filesystem::path& file, const World& world);

// `count` rows drawn by the world's arrival mix. The same seed and world give the same rows.
[[nodiscard]] Expected<Manifest> draw_manifest(const World& world, std::int64_t count, std::uint64_t seed);

}  // namespace pons::world
