#include "apps/meeting.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <fstream>
#include <iterator>
#include <random>
#include <string_view>
#include <utility>

#include "pons/bridge/journal/place.hpp"
#include "pons/core/digest.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;

// All that says what the cell is: a limit, a camera or a link's mass in one of them makes it another.
Expected<std::uint64_t> cell_of(const world::World& world) {
  Digest digest;
  for (const fs::path& path :
       {world.folder / "world.yaml", world.scene_mjcf, world.robot.urdf, world.robot.tool.mjcf}) {
    std::ifstream file(path, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(file)), {});
    if (!file) return fail("cannot be read", path.string(), "it was there when the world was loaded");
    digest.add(text);
    digest.add(text.size());
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

constexpr std::string_view kInMemory = ":memory:";

// From wherever it is named, and through whatever link.
std::string absolute(const std::string& journal) {
  if (bridge::in_database(journal) || journal == kInMemory) return journal;
  std::error_code failed;
  const fs::path path = fs::absolute(journal, failed), resolved = fs::weakly_canonical(path, failed);
  return (failed ? path : resolved).string();
}

// Passwords may change.
bool is_same(const std::string& one, const std::string& other) { return bridge::shown(one) == bridge::shown(other); }

}  // namespace

std::string default_link(const std::string& world) { return fmt::format("{}-{}", world, getuid()); }

Expected<link::Identity> identity_of(const world::World& world, const world::Manifest& manifest) {
  const auto cell = cell_of(world);
  if (!cell) return std::unexpected(cell.error());
  link::Identity identity;
  world.name.copy(identity.world.data(), identity.world.size() - 1);
  identity.cell = *cell;
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

std::string journal_of(const link::Border& border) { return border.journal(); }

Expected<void> find_journal(const link::Border& border, const std::string& journal) {
  const std::string earlier = border.journal(), here = absolute(journal);
  if (earlier.empty()) return {};
  if (!is_same(earlier, here)) {
    return fail("is not the journal of this body's bridges, which holds what was told and what hangs on the arm",
                bridge::shown(journal),
                fmt::format("go on with --journal {}; to begin anew, end the body, too", bridge::shown(earlier)));
  }
  std::error_code ignored;
  if (bridge::in_database(here) || here == kInMemory || fs::exists(here, ignored)) return {};
  return fail(
      "the journal is gone that the bridges of this body kept, and with it what was told and what hangs on the arm",
      journal, "put it back; to begin anew, end the body, too");
}

Expected<void> name_journal(link::Border& border, const std::string& journal) {
  if (!border.name_journal(absolute(journal))) return fail("it is too long", "--journal", "choose a shorter one");
  return {};
}

}  // namespace pons::apps
