#include "pons/skills/take_up.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <span>
#include <vector>

#include "pons/skills/grasp.hpp"

namespace pons::skills {
namespace {

using task::Json;

constexpr double kTall_m = 0.30;    // as what stands on the belt mostly is at most
constexpr double kOver_m = 0.06;    // over that, the load, which swings
constexpr double kBeyond_m = 0.01;  // so that a rise is enough
constexpr double kHidden_m = 0.45;  // along the belt: how far arm and load hide what stands there
constexpr double kRise_m_s2 = 3.0;
constexpr int kTries = 3;  // to rise, and to step aside: what stops the arm each time may stay there
constexpr Duration kStopped = std::chrono::milliseconds(100);  // between two calls: the arm was stopped
constexpr Duration kInstant = std::chrono::milliseconds(1);
constexpr Duration kLook = std::chrono::milliseconds(500);  // two frames

Json of(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

Vector3 vector_from(const Json& json, const char* key) {
  const auto values = json.value(key, std::array<double, 3>{});
  return {values[0], values[1], values[2]};
}

}  // namespace

const Json& TakeUp::carries() {
  const std::optional<Held>& held = cell_.held ? cell_.held : cell_.lost;
  const bool gone = !cell_.held;
  if (held != told_ || gone != told_gone_) {
    carries_ = held ? written(*held) : Json{};
    if (held && gone) carries_["gone"] = true;
    told_ = held;
    told_gone_ = gone;
  }
  return carries_;
}

Json TakeUp::written(const Held& held) const {
  Json carried = {{"code", held.code},
                  {"mass_kg", held.mass_kg},
                  {"size_m", of(held.load.size_m)},
                  {"yaw_rad", held.load.yaw_in_tip_rad},
                  {"offset_m", of(held.load.offset_in_tip_m)},
                  {"alone", held.alone},
                  {"doubtful", held.doubtful},
                  {"falls", std::span(held.falls).first(cell_.world.places.size())}};
  if (held.from_m) carried["from_m"] = of(*held.from_m);
  return carried;
}

void TakeUp::restore(const Json& carried) {
  cell_.unseen_end(kTall_m);
  if (!carried.is_object()) return;
  carried_ = carried.value("code", std::string{});
  const Held held{.code = carried_,
                  .load = {.size_m = vector_from(carried, "size_m"),
                           .yaw_in_tip_rad = carried.value("yaw_rad", 0.0),
                           .offset_in_tip_m = vector_from(carried, "offset_m")},
                  .mass_kg = carried.value("mass_kg", 0.0),
                  .alone = carried.value("alone", true),
                  .from_m = carried.contains("from_m") ? std::optional(vector_from(carried, "from_m")) : std::nullopt,
                  .falls = falls_from(carried),
                  .doubtful = carried.value("doubtful", false)};
  if (!cell_.arm.cups().open && !carried.value("gone", false)) {
    cell_.held = held;
    return;
  }
  cell_.lost = held;
  cell_.holds_nothing();
}

Falls TakeUp::falls_from(const Json& carried) const {
  Falls falls = cell_.falls();
  const auto written = carried.value("falls", std::vector<std::uint16_t>{});
  std::ranges::copy(std::span(written).first(std::min(written.size(), falls.size())), falls.begin());
  return falls;
}

TakeUp::Fate TakeUp::fate(const task::Task& task, std::size_t done) const {
  const task::Step& next = task.steps[done];
  if (next.skill == "move_to" || next.skill == "detect") return Fate::kGoesOn;
  std::string object = next.arguments.value("object", std::string{});
  if (object.empty()) object = carried_;
  if (object.empty() || object != carried_) return Fate::kBroken;
  if (cell_.held) return Fate::kGoesOn;
  if (next.skill != "place") return Fate::kBroken;
  const auto place = next.arguments.value("place", std::string{});
  if (const auto chutes = fallen_into(); !chutes.empty()) {
    // Of two counts the other is another's.
    const bool own = std::ranges::find(chutes, place, &world::Place::name) != chutes.end();
    return own ? Fate::kDone : Fate::kAstray;
  }
  // Let go of there and still falling, or lost before it came there: the step waits for its mouth's light curtain.
  return is_over(place) ? Fate::kGoesOn : Fate::kLost;
}

std::vector<const world::Place*> TakeUp::fallen_into() const {
  if (!cell_.lost || cell_.held) return {};
  return cell_.mouths.fallen_since(cell_.lost->falls);
}

std::string TakeUp::fell_into() const {
  const auto chutes = fallen_into();
  return chutes.empty() ? std::string() : chutes.back()->name;
}

bool TakeUp::is_over(const std::string& name) const {
  const world::Place* const place = cell_.world.place(name);
  const link::State& state = cell_.arm.state();
  if (place == nullptr || state.vacuum_on != 0 || state.position.size() == 0) return false;
  const Vector3 tip = cell_.model.world_from_tip(state.position).translation();
  const Vector3 off = (tip - place->center_m).cwiseAbs();
  return off.x() < 0.5 * place->size_m.x() && off.y() < 0.5 * place->size_m.y();
}

bool TakeUp::settle(Time now) {
  if (!called_ || now - *called_ > kStopped) looks_until_ = now + kLook, aside_ = false;
  called_ = now;
  if (!cell_.held) {
    if (cell_.arm.state().vacuum_on != 0) cell_.arm.vacuum(false);
    if (!cell_.arm.cups().open && now < looks_until_) return false;
    if (rises_ == 0 && steps_ == 0) cell_.holds_nothing();
  }
  hide_below();
  if (now < cell_.arm.motion_end()) {
    looks_until_ = cell_.arm.motion_end() + kLook;
    return false;
  }
  const double low_m = too_low_m();
  if (low_m > 0 && rises_++ < kTries) {
    // As far as the arm gets.
    if (rise(now, low_m) || rise(now, 0.5 * low_m) || rise(now, 0.25 * low_m)) return false;
  }
  if (!cell_.held && !aside_ && steps_ < kTries) {
    aside_ = cell_.step_aside(now);
    if (aside_) return ++steps_, false;
  }
  if (cell_.seen() < looks_until_) return false;
  cell_.arm.expect_contact(0);
  if (!cell_.held && aside_) cell_.hides_nothing();
  return true;
}

// Arm or load are over it, or overhang it.
bool TakeUp::is_over_belt() const {
  const world::Belt& belt = cell_.world.belt;
  const Vector3 tip = cell_.model.world_from_tip(cell_.arm.state().position).translation();
  const double reach_m = cell_.held ? 0.5 * cell_.held->load.size_m.head<2>().norm() : 0;
  return std::abs(tip.y() - belt.y_center_m) < 0.5 * belt.width_m + reach_m && tip.x() > belt.x_start_m - reach_m &&
         tip.x() < belt.x_end_m + reach_m;
}

// By how much the load, or else the tip, stands below what may stand on the belt beside it.
double TakeUp::too_low_m() const {
  const double tip_z = cell_.model.world_from_tip(cell_.arm.state().position).translation().z();
  return is_over_belt() ? cell_.world.belt.surface_z_m + kTall_m + kOver_m + load_height_m() - tip_z : 0;
}

bool TakeUp::rise(Time now, double by_m) {
  const Time from = cell_.arm.splice_time(now);
  const AxisState state = cell_.arm.planned(from);
  Pose tip = cell_.model.world_from_tip(state.position);
  const Eigen::Matrix3d orientation = tip.linear();
  tip.translation().z() += by_m + kBeyond_m;
  // A wide load that is lifted to the height of the base meets the arm itself.
  const auto top = cell_.model.inverse(tip, state.position);
  if (!top || !cell_.router.clear_at(*top, from, from + kInstant, cell_.held ? &cell_.held->load : nullptr, {}))
    return false;
  const auto up = lift(cell_, state, from, orientation, {0, 0, by_m + kBeyond_m}, kRise_m_s2);
  if (!up || !cell_.arm.stream(up->trajectory)) return false;
  cell_.arm.expect_contact(kHandling_n);
  return true;
}

// What arm and load pass over. Lower, it would hold them.
void TakeUp::hide_below() {
  const double tip_z = cell_.model.world_from_tip(cell_.arm.state().position).translation().z();
  const double passes_m = tip_z - load_height_m() - kOver_m - cell_.world.belt.surface_z_m;
  if (is_over_belt() && passes_m > 0) cell_.hides(kHidden_m, std::min(kTall_m, passes_m));
}

double TakeUp::load_height_m() const { return cell_.held ? cell_.held->load.size_m.z() : 0; }

}  // namespace pons::skills
