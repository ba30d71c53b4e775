#include "apps/cell_facts.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace pons::apps {
namespace {

using task::Json;

void add_size(const Vector3& size_m, Json& known) {
  known["length_m"] = std::max(size_m.x(), size_m.y());
  known["width_m"] = std::min(size_m.x(), size_m.y());
  known["height_m"] = size_m.z();
}

constexpr std::array kPlaceKinds{world::PlaceKind::kChute, world::PlaceKind::kException, world::PlaceKind::kTray,
                                 world::PlaceKind::kRegion, world::PlaceKind::kObstacle};

}  // namespace

task::Facts facts_of(std::vector<const skills::Cell*> cells, brain::Orders orders) {
  auto of = [cells = std::move(cells), orders = std::move(orders)](std::string_view thing) {
    Json known = Json::object();
    if (thing == "home") return Json{{"kind", "home"}};
    if (const world::Place* const place = cells.front()->world.place(thing))
      return Json{{"kind", world::name(place->kind)}};
    // Of what nobody has ordered that much is known.
    const auto order = orders.find(thing);
    known["destination"] = order == orders.end() ? std::string() : order->second.destination;
    known["priority"] = order == orders.end() ? 0 : order->second.priority;
    if (const ObjectBelief* const seen = cells.front()->find(thing)) add_size(seen->size_m, known);
    for (const skills::Cell* const cell : cells) {
      if (!cell->held || cell->held->code != thing) continue;
      add_size(cell->held->load.size_m, known);
      if (cell->held->mass_kg > 0) known["mass_kg"] = cell->held->mass_kg;
    }
    return known;
  };
  std::vector<std::string> kinds{"home"};
  for (const world::PlaceKind kind : kPlaceKinds) kinds.emplace_back(world::name(kind));
  return {{"kind", "destination", "priority", "length_m", "width_m", "height_m", "mass_kg"},
          std::move(of),
          {{"kind", std::move(kinds)}}};
}

}  // namespace pons::apps
