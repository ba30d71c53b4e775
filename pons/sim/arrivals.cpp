#include "pons/sim/arrivals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unordered_set>

#include "pons/core/random.hpp"

namespace pons::sim {
namespace {

constexpr std::uint64_t kParcelStream = 0x70617263;  // names of the random streams
constexpr std::uint64_t kGroupStream = 0x67726f75;
constexpr double kPi = std::numbers::pi;
constexpr double kEdgeFree_m = 0.012;  // belt left free at its sides
constexpr double kSettle_m = 0.003;    // let down from so high
constexpr double kSide_m = 0.0005;     // between neighbours that touch

struct Footprint {
  double x = 0, y = 0;  // half extents along the belt and across
};

Footprint footprint(const Vector3& size, double yaw) {
  const double c = std::abs(std::cos(yaw)), s = std::abs(std::sin(yaw));
  return {0.5 * (size.x() * c + size.y() * s), 0.5 * (size.x() * s + size.y() * c)};
}

std::array<float, 3> draw_color(Random& random, world::ParcelKind kind) {
  static constexpr std::array<std::array<float, 3>, 7> kShades{{{0.72f, 0.55f, 0.37f},
                                                                {0.64f, 0.47f, 0.31f},
                                                                {0.80f, 0.66f, 0.47f},
                                                                {0.86f, 0.86f, 0.84f},
                                                                {0.55f, 0.57f, 0.60f},
                                                                {0.33f, 0.47f, 0.66f},
                                                                {0.76f, 0.62f, 0.24f}}};
  // Boxes are mostly kraft, mailers and bags of any colour.
  const std::uint64_t shade = random.below(kind == world::ParcelKind::kBox ? 4 : kShades.size());
  const auto light = static_cast<float>(random.uniform(0.9, 1.08));
  std::array<float, 3> color{};
  for (std::size_t i = 0; i < 3; ++i) color[i] = std::min(1.0f, kShades[shade][i] * light);
  return color;
}

// An id of the same pattern that no row has.
std::string unknown_code(const std::string& id, const std::unordered_set<std::string>& known, Random& random) {
  for (;;) {
    std::string code = fmt::format("X{:06}", random.below(1'000'000));
    if (code != id && !known.contains(code)) return code;
  }
}

// What belongs to one parcel whatever lies beside it.
Arrival draw_parcel(const world::Arrivals& mix, const world::ManifestRow& row, Random random,
                    const std::unordered_set<std::string>& known) {
  Arrival arrival;
  arrival.label_text = row.parcel_id;
  if (random.uniform() < mix.unreadable) {
    arrival.label = static_cast<LabelState>(1 + random.below(3));
    if (arrival.label == LabelState::kUnknownCode) arrival.label_text = unknown_code(row.parcel_id, known, random);
  }
  arrival.mass_kg = row.mass_kg;
  arrival.label_offset = {random.uniform(-1, 1), random.uniform(-1, 1)};
  arrival.label_turn = static_cast<int>(random.below(4));
  arrival.color = draw_color(random, row.kind);
  arrival.gap_m = random.uniform(mix.gap_min_m, mix.gap_max_m);
  return arrival;
}

Pose lying(double x, double y, double z, double yaw, bool label_down) {
  Pose pose = pose_xyz_yaw(x, y, z, yaw);
  if (label_down) pose.rotate(Eigen::AngleAxisd(kPi, Vector3::UnitX()));
  return pose;
}

double clamp_to_belt(double y, double half_extent, double belt_width) {
  const double room = std::max(0.0, 0.5 * belt_width - kEdgeFree_m - half_extent);
  return std::clamp(y, -room, room);
}

// Puts `next` down touching the one before it: beside it if there is `room_beside` (it may have to move over for that),
// behind it, partly on it or leaning on it.
Pose beside(Pose& before, const Vector3& before_size, const Vector3& size, double yaw, double belt_width,
            bool label_down, bool room_beside, Random& random) {
  const Footprint front = footprint(before_size, yaw), own = footprint(size, yaw);
  const Vector3 at = before.translation();
  const double rest_z = 0.5 * size.z() + kSettle_m;
  const double choice = random.uniform();
  const double shift = random.uniform(-0.25, 0.25) * before_size.y();
  const Eigen::Rotation2Dd turn(yaw);
  if (room_beside && choice < 0.3 && front.y + own.y < 0.5 * belt_width - kEdgeFree_m) {
    const Eigen::Vector2d step = turn * Eigen::Vector2d(0, 0.5 * (before_size.y() + size.y()) + kSide_m);
    const double side = at.y() > 0 ? -1 : 1;
    const double y = at.y() + side * step.y(), inside_y = clamp_to_belt(y, own.y, belt_width);
    before.translation().y() += inside_y - y;
    return lying(at.x() + side * step.x(), inside_y, rest_z, yaw, label_down);
  }
  const double top = at.z() + 0.5 * before_size.z();
  if (choice > 0.6 && size.z() < 0.08 && top < 0.3 * size.x()) {
    const double lap = random.uniform(0.2, 0.45) * std::min(size.x(), before_size.x());
    const Eigen::Vector2d step = turn * Eigen::Vector2d(-0.5 * (before_size.x() + size.x()) + lap, shift);
    // Its front edge rests on the one before, its rear edge on the belt.
    const double tilt = std::asin(std::clamp(top / (size.x() - lap), 0.0, 0.6));
    Pose pose = pose_xyz_yaw(at.x() + step.x(), clamp_to_belt(at.y() + step.y(), own.y, belt_width),
                             0.5 * size.x() * std::sin(tilt) + 0.5 * size.z() + 2 * kSettle_m, yaw);
    pose.rotate(Eigen::AngleAxisd(-tilt, Vector3::UnitY()));
    if (label_down) pose.rotate(Eigen::AngleAxisd(kPi, Vector3::UnitX()));
    return pose;
  }
  const Eigen::Vector2d step = turn * Eigen::Vector2d(-0.5 * (before_size.x() + size.x()) - kSide_m, shift);
  return lying(at.x() + step.x(), clamp_to_belt(at.y() + step.y(), own.y, belt_width), rest_z, yaw, label_down);
}

// Upstream along the belt, until `pose` is clear of `other`; the sides of both run along `yaw`.
void move_behind(Pose& pose, const Vector3& size, const Pose& other, const Vector3& other_size, double yaw) {
  const Eigen::Rotation2Dd turn(yaw);
  const Eigen::Vector2d apart = turn.inverse() * (pose.translation() - other.translation()).head<2>();
  const Eigen::Vector2d touching = 0.5 * (size + other_size).head<2>();
  if (std::abs(apart.y()) >= touching.y() || apart.x() <= -touching.x()) return;
  pose.translation().x() -= (touching.x() + kSide_m + apart.x()) / std::cos(yaw);
}

bool is_level(const Pose& pose) { return std::abs(pose.linear()(2, 2)) > 0.999; }

// Lays out rows [first, first + count) as one group.
void lay_out(std::vector<Arrival>& arrivals, const world::Manifest& manifest, std::size_t first, std::size_t count,
             double belt_width, Random random) {
  const double yaw = count == 1 ? random.uniform(-kPi, kPi) : random.uniform(-0.35, 0.35);
  double front = -1e9, rear = 1e9;
  for (std::size_t i = first; i < first + count; ++i) {
    Arrival& arrival = arrivals[i];
    const Vector3& size = manifest[i].size_m;
    const bool down = arrival.label == LabelState::kDown;
    const Footprint own = footprint(size, yaw);
    if (i == first) {
      const double y = clamp_to_belt(random.uniform(-0.08, 0.08), own.y, belt_width);
      arrival.group_from_middle = lying(0, y, 0.5 * size.z() + kSettle_m, yaw, down);
    } else {
      Pose& pose = arrival.group_from_middle;
      const bool second = i == first + 1;
      pose = beside(arrivals[i - 1].group_from_middle, manifest[i - 1].size_m, size, yaw, belt_width, down, second,
                    random);
      for (std::size_t j = first; j < i; ++j) {
        if (j + 1 == i && !is_level(pose)) break;  // it leans on that one
        move_behind(pose, size, arrivals[j].group_from_middle, manifest[j].size_m, yaw);
      }
    }
    arrival.touching = count > 1;
  }
  for (std::size_t i = first; i < first + count; ++i) {
    const double x = arrivals[i].group_from_middle.translation().x(), half_m = footprint(manifest[i].size_m, yaw).x;
    front = std::max(front, x + half_m);
    rear = std::min(rear, x - half_m);
  }
  for (std::size_t i = first; i < first + count; ++i) {
    arrivals[i].group_from_middle.translation().x() -= front;
    arrivals[i].group_length_m = front - rear;
  }
}

}  // namespace

std::vector<Arrival> plan_arrivals(const world::World& world, const world::Manifest& manifest, std::uint64_t seed) {
  const Random root(seed);
  std::unordered_set<std::string> known;
  for (const world::ManifestRow& row : manifest) known.insert(row.parcel_id);
  std::vector<Arrival> arrivals;
  arrivals.reserve(manifest.size());
  for (std::size_t i = 0; i < manifest.size(); ++i) {
    arrivals.push_back(draw_parcel(world.arrivals, manifest[i], root.fork(kParcelStream).fork(i), known));
  }
  std::size_t touching = 0;
  int group = 0;
  for (std::size_t first = 0; first < manifest.size(); ++group) {
    Random random = root.fork(kGroupStream).fork(first);
    // Held to the share all along, so that short runs have it, too.
    const double behind = world.arrivals.touching * static_cast<double>(first + 8) - static_cast<double>(touching);
    std::size_t count = 1;
    if (behind > random.uniform(0.0, 2.0) && world.arrivals.touching > 0) count = random.uniform() < 0.25 ? 3 : 2;
    count = std::min(count, manifest.size() - first);
    for (std::size_t i = first; i < first + count; ++i) arrivals[i].group = group;
    lay_out(arrivals, manifest, first, count, world.belt.width_m, random);
    if (count > 1) touching += count;
    first += count;
  }
  return arrivals;
}

}  // namespace pons::sim
