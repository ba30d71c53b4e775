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
  int priority = 0;  // 0 … 100; express is 80 and above
};

using Manifest = std::vector<ManifestRow>;

inline constexpr std::size_t kMaxParcels = 1'000'000;

// Columns parcel_id,destination,kind,length_m,width_m,height_m,mass_kg,priority in any order, UTF-8, at most 1 MiB a
// line and kMaxParcels rows. A parcel_id is 1 to 14 of A–Z, 0–9 and - (fits a QR code of version 1 up to level Q, 16
// characters), length and width hold the label. Errors name file, line and column.
[[nodiscard]] Expected<Manifest> read_manifest(const std::filesystem::path& file, const World& world);

// `count` rows, 1 … kMaxParcels, drawn by the world's arrival mix: P000001 and so on. The same seed and world give the
// same rows, and a shorter draw is the beginning of a longer one. Lengths are whole millimetres, masses whole grams.
[[nodiscard]] Expected<Manifest> draw_manifest(const World& world, std::int64_t count, std::uint64_t seed);

}  // namespace pons::world
