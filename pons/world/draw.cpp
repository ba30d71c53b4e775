#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pons/core/random.hpp"
#include "pons/world/manifest.hpp"

namespace pons::world {
namespace {

constexpr int kOrdinary = 50;  // priorities
constexpr int kExpress = 90;
constexpr std::uint64_t kStream = 0x6d616e6966657374;  // "manifest": apart from what else draws from the seed

double to_mm(double length_m) { return std::round(length_m * 1e3) / 1e3; }
double to_g(double mass_kg) { return std::round(mass_kg * 1e3) / 1e3; }

// Uniform between low and high, both first brought inside the world's span of lengths.
double draw_length(Random& random, const Arrivals& mix, double low, double high) {
  const auto inside = [&](double length) { return std::clamp(length, mix.length_min_m, mix.length_max_m); };
  return to_mm(random.uniform(inside(low), std::max(inside(low), inside(high))));
}

double draw_height(Random& random, double low, double high) { return to_mm(random.uniform(low, std::max(low, high))); }

ParcelKind draw_kind(Random& random, const Arrivals& mix) {
  const double share = random.uniform();
  if (share < mix.box) return ParcelKind::kBox;
  if (share < mix.box + mix.mailer) return ParcelKind::kMailer;
  if (share < mix.box + mix.mailer + mix.tube) return ParcelKind::kTube;
  return ParcelKind::kBag;
}

// Boxes lie on their widest face or nearly so: none is higher than its shorter side, so that none topples by itself.
Vector3 draw_size(Random& random, ParcelKind kind, const Arrivals& mix) {
  Vector3 size;
  switch (kind) {
    case ParcelKind::kBox:
      size.x() = draw_length(random, mix, 0.10, 0.36);
      size.y() = draw_length(random, mix, 0.45 * size.x(), size.x());
      size.z() = draw_height(random, 0.05, std::min(0.20, size.y()));
      break;
    case ParcelKind::kMailer:
      size.x() = draw_length(random, mix, 0.15, 0.40);
      size.y() = draw_length(random, mix, std::max(0.15, 0.55 * size.x()), std::min(0.30, size.x()));
      size.z() = draw_height(random, 0.02, 0.04);
      break;
    case ParcelKind::kTube:
      size.x() = draw_length(random, mix, 0.15, 0.40);
      size.y() = draw_length(random, mix, 0.08, 0.12);
      size.z() = size.y();
      break;
    case ParcelKind::kBag:
      size.x() = draw_length(random, mix, 0.15, 0.35);
      size.y() = draw_length(random, mix, std::max(0.12, 0.55 * size.x()), std::min(0.28, size.x()));
      size.z() = draw_height(random, 0.05, std::min(0.12, 0.6 * size.y()));
      break;
  }
  return size;
}

// Log-uniform density (kg/m³) between what the kind's contents usually have, narrowed to the masses the world allows.
double draw_mass(Random& random, ParcelKind kind, const Vector3& size, const Arrivals& mix) {
  double low = 60, high = 400;
  if (kind == ParcelKind::kMailer) low = 100, high = 350;
  if (kind == ParcelKind::kTube) low = 80, high = 300;
  if (kind == ParcelKind::kBag) low = 50, high = 250;
  const double lightest = std::log(low * size.prod());
  const double heaviest = std::log(std::min(high * size.prod(), mix.mass_max_kg));
  const double mass = std::exp(random.uniform(std::min(lightest, heaviest), heaviest));
  return to_g(std::clamp(mass, mix.mass_min_kg, mix.mass_max_kg));
}

ManifestRow draw_row(Random random, const World& world, const std::vector<std::string>& chutes) {
  const Arrivals& mix = world.arrivals;
  ManifestRow row;
  row.destination = chutes[random.below(chutes.size())];
  row.priority = random.uniform() < mix.express ? kExpress : kOrdinary;
  const double share = random.uniform();
  const bool overweight = share < mix.overweight;
  const bool oversize = !overweight && share < mix.overweight + mix.oversize;
  row.kind = draw_kind(random, mix);
  if (overweight) row.kind = ParcelKind::kBox;  // a mailer or a bag of that mass would be of lead
  row.size_m = draw_size(random, row.kind, mix);
  row.mass_kg = draw_mass(random, row.kind, row.size_m, mix);
  // Well clear of the rule on either side, so that it is plain which parcels deserve to be an exception.
  if (overweight) row.mass_kg = to_g(random.uniform(kOverweightFactor * world.rules.max_mass_kg, mix.max_mass_kg));
  if (oversize) row.size_m.x() = to_mm(world.rules.max_size_m * random.uniform(1.05, 1.25));
  return row;
}

}  // namespace

Expected<Manifest> draw_manifest(const World& world, std::int64_t count, std::uint64_t seed) {
  if (count < 1 || count > static_cast<std::int64_t>(kMaxParcels)) {
    return fail(fmt::format("{} parcels cannot be drawn", count), "parcels",
                fmt::format("ask for 1 to {}", kMaxParcels));
  }
  std::vector<std::string> chutes;
  for (const std::string& name : world.place_names()) {
    if (world.place(name)->kind == PlaceKind::kChute) chutes.push_back(name);
  }
  if (chutes.empty()) return fail("the world has no chute", world.name, "add a place of kind chute");
  const Random stream = Random(seed).fork(kStream);
  Manifest manifest;
  manifest.reserve(static_cast<std::size_t>(count));
  for (std::int64_t i = 1; i <= count; ++i) {
    manifest.push_back(draw_row(stream.fork(static_cast<std::uint64_t>(i)), world, chutes));
    manifest.back().parcel_id = fmt::format("P{:06}", i);
  }
  return manifest;
}

}  // namespace pons::world
