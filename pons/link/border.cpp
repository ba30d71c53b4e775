#include "pons/link/border.hpp"

#include <fmt/format.h>
#include <algorithm>

namespace pons::link {

Expected<void> check_same(const Identity& body, const Identity& bridge, const std::string& name) {
  if (std::string_view(body.world.data()) != std::string_view(bridge.world.data())) {
    return fail(fmt::format("the body runs the world '{}', not '{}'", body.world.data(), bridge.world.data()), name,
                "name that world, or choose another --link");
  }
  if (body.cell != bridge.cell) {
    return fail(
        fmt::format("the body's '{}' is another cell: its world, scene, robot or tool differs", body.world.data()),
        name, "start both from the same folder of worlds");
  }
  if (body.orders != bridge.orders) {
    return fail("the body was started with other parcels", name,
                "give both the same --parcels and --seed, or --manifest");
  }
  return {};
}

bool Border::name_journal(std::string_view path) {
  if (path.size() >= kLongestPath) return false;
  // The body reads from then on: one bridge may be about to write, but into the other place, and none follows it.
  if (now_at() == Stage::kEnded) return true;
  const std::uint32_t next = named_.load() + 1;
  auto& place = paths_[next % paths_.size()];
  place.fill(0);
  std::ranges::copy(path, place.begin());
  named_.store(next);
  return true;
}

std::string Border::journal() const {
  const std::uint32_t named = named_.load();
  return named == 0 ? std::string() : std::string(paths_[named % paths_.size()].data());
}

}  // namespace pons::link
