#include "pons/skills/take_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pons::skills {
namespace {

using task::Json;

Json of(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Vector3 vector_from(const Json& json, const char* key) {
  const auto values = json.value(key, std::array<double, 3>{});
  return {values[0], values[1], values[2]};
}

}  // namespace

Json TakeUp::carries() const {
  if (!cell_.held) return {};
  const Held& held = *cell_.held;
  return {{"code", held.code},
          {"mass_kg", held.mass_kg},
          {"size_m", of(held.load.size_m)},
          {"yaw_rad", held.load.yaw_in_tip_rad},
          {"offset_m", of(held.load.offset_in_tip_m)}};
}

void TakeUp::restore(const Json& carried) {
  if (!carried.is_object()) return;
  carried_ = carried.value("code", std::string{});
  if (cell_.arm.cups().open) {
    cell_.holds_nothing();
    return;
  }
  cell_.held = Held{.code = carried_,
                    .load = {.size_m = vector_from(carried, "size_m"),
                             .yaw_in_tip_rad = carried.value("yaw_rad", 0.0),
                             .offset_in_tip_m = vector_from(carried, "offset_m")},
                    .mass_kg = carried.value("mass_kg", 0.0)};
}

TakeUp::Fate TakeUp::fate(const task::Task& task, std::size_t done) const {
  const task::Step& next = task.steps[done];
  if (next.skill == "move_to" || next.skill == "detect") return Fate::kGoesOn;
  std::string object = next.arguments.value("object", std::string{});
  if (object.empty()) object = carried_;
  if (object.empty() || object != carried_) return Fate::kBroken;
  if (cell_.held) return Fate::kGoesOn;
  if (next.skill != "place") return Fate::kBroken;
  return is_over(next.arguments.value("place", std::string{})) ? Fate::kDone : Fate::kLost;
}

bool TakeUp::is_over(const std::string& name) const {
  const world::Place* const place = cell_.world.place(name);
  const link::State& state = cell_.arm.state();
  if (place == nullptr || state.vacuum_on != 0 || state.position.size() == 0) return false;
  const Vector3 tip = cell_.model.world_from_tip(state.position).translation();
  const Vector3 off = (tip - place->center_m).cwiseAbs();
  return off.x() < 0.5 * place->size_m.x() && off.y() < 0.5 * place->size_m.y();
}

void TakeUp::settle() {
  if (!cell_.held && cell_.arm.state().vacuum_on != 0) cell_.arm.vacuum(false);
}

}  // namespace pons::skills
