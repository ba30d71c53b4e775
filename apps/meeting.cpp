#include "apps/meeting.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <random>
#include <utility>

#include "pons/core/digest.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

void add(Digest& digest, const Pose& pose) { digest.add(std::span<const double>(pose.matrix().data(), 16)); }
void add(Digest& digest, const AxisVector& values) {
  digest.add(std::span<const double>(values.data(), static_cast<std::size_t>(values.size())));
}
void add(Digest& digest, const Vector3& vector) { digest.add(std::span<const double>(vector.data(), 3)); }

std::uint64_t cell_of(const world::World& world) {
  Digest digest;
  const world::Robot& robot = world.robot;
  digest.add(robot.name);
  digest.add(robot.flange_link);
  add(digest, robot.world_from_base);
  add(digest, robot.home);
  const AxisLimits& limits = robot.limits;
  for (const AxisVector* values : {&limits.position_min, &limits.position_max, &limits.speed_rad_s,
                                   &limits.acceleration_rad_s2, &limits.jerk_rad_s3, &limits.torque_nm})
    add(digest, *values);
  add(digest, robot.tool.flange_from_tip);
  for (const Vector3& cup : robot.tool.cups_m) add(digest, cup);
  const world::Belt& belt = world.belt;
  for (const double value : {belt.x_start_m, belt.x_end_m, belt.y_center_m, belt.width_m, belt.surface_z_m,
                             belt.speed_m_s, belt.pick_x_min_m, belt.pick_x_max_m})
    digest.add(value);
  for (const world::Place& place : world.places) {
    digest.add(place.name);
    add(digest, place.center_m);
    add(digest, place.size_m);
  }
  for (const world::CameraSpec& camera : world.cameras) {
    digest.add(camera.name);
    digest.add(camera.watches);
    add(digest, camera.world_from_optical);
    digest.add(camera.width);
    digest.add(camera.height);
    digest.add(camera.fovy_rad);
  }
  return digest.value();
}

std::uint64_t orders_of(const world::Manifest& manifest) {
  Digest digest;
  for (const world::ManifestRow& row : manifest) {
    digest.add(row.parcel_id);
    digest.add(row.destination);
    digest.add(row.priority);
  }
  return digest.value();
}

rt::SharedMemory::Layout layout_of(const link::FramePages& pages) { return {pages.bytes(), link::kFramesVersion}; }

}  // namespace

std::string default_link(const std::string& world) { return fmt::format("{}-{}", world, getuid()); }

link::Identity identity_of(const world::World& world, const world::Manifest& manifest) {
  link::Identity identity;
  world.name.copy(identity.world.data(), identity.world.size() - 1);
  identity.cell = cell_of(world);
  identity.orders = orders_of(manifest);
  return identity;
}

Expected<MeetingPlace> MeetingPlace::make(const std::string& name, const world::World& world,
                                          const link::Identity& identity) {
  MeetingPlace place;
  place.pages_ = std::make_unique<link::FramePages>(runner::pages_of(world));
  // Before the border: who sees that one finds these pages, too.
  auto pixels = rt::SharedMemory::make(link::frames_name(name), layout_of(*place.pages_));
  if (!pixels) return std::unexpected(pixels.error());
  place.pixels_ = std::make_unique<rt::SharedMemory>(std::move(*pixels));
  if (auto published = place.pixels_->publish(); !published) return std::unexpected(published.error());
  std::random_device chance;
  const std::uint64_t life = (static_cast<std::uint64_t>(chance()) << 32U) | chance();
  auto border = rt::Shared<link::Border>::make(name, identity, life);
  if (!border) return std::unexpected(border.error());
  place.border_ = std::make_unique<rt::Shared<link::Border>>(std::move(*border));
  return place;
}

Expected<MeetingPlace> MeetingPlace::join(const std::string& name, const world::World& world,
                                          const link::Identity& identity) {
  MeetingPlace place;
  auto border = rt::Shared<link::Border>::open(name);
  if (!border) return std::unexpected(border.error());
  place.border_ = std::make_unique<rt::Shared<link::Border>>(std::move(*border));
  if (auto same = link::check_same(place.border().identity, identity, "--link " + name); !same)
    return std::unexpected(same.error());
  place.pages_ = std::make_unique<link::FramePages>(runner::pages_of(world));
  auto pixels = rt::SharedMemory::open(link::frames_name(name), layout_of(*place.pages_));
  if (!pixels) return std::unexpected(pixels.error());
  place.pixels_ = std::make_unique<rt::SharedMemory>(std::move(*pixels));
  return place;
}

fs::path journal_of(const link::Border& border) { return border.journal(); }

Expected<void> name_journal(link::Border& border, const fs::path& journal) {
  std::error_code ignored;
  if (!border.name_journal(fs::absolute(journal, ignored).string()))
    return fail("the path is too long", "--journal", "choose a shorter one");
  return {};
}

}  // namespace pons::apps
