#include "pons/link/border.hpp"

#include <fmt/format.h>

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

}  // namespace pons::link
