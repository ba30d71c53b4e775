#include "tests/system/plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pons::tests {
namespace {

constexpr double kPeriod_s = 0.01;
constexpr double kReach_m = 0.02;   // between cups and a parcel that they take
constexpr double kBeside_m = 0.06;  // and so far beside its middle
constexpr double kGap_m = 0.15;
constexpr double kSealed_kpa = 60;

bool is_over(const world::Place& place, const Vector3& tip) {
  const Vector3 off = (tip - place.center_m).cwiseAbs();
  return off.x() < 0.5 * place.size_m.x() && off.y() < 0.5 * place.size_m.y();
}

}  // namespace

Plant::Plant(const world::World& world, model::RobotModel model, Random random, Say say)
    : world_(world), model_(std::move(model)), random_(random), say_(std::move(say)) {
  sensors_.position = world_.robot.home;
  sensors_.speed = AxisVector::Zero(sensors_.position.size());
}

Vector3 Plant::tip() { return model_.world_from_tip(sensors_.position).translation(); }

void Plant::step(Time now, const link::State& loop, const body::SetPoints& told) {
  const AxisVector before = sensors_.position;
  sensors_.stamp = now;
  if (told.power) {
    sensors_.position = loop.commanded.position;
    sensors_.speed = loop.commanded.speed;
  } else {
    sensors_.speed.setZero();
  }
  moves_ = (sensors_.position - before).cwiseAbs().maxCoeff() > 1e-9;
  sensors_.belt_speed_m_s = told.belt_runs ? world_.belt.speed_m_s : 0;
  sensors_.belt_travel_m += kPeriod_s * sensors_.belt_speed_m_s;
  if (told.vacuum_on != 0 && told_cups_ == 0) misses_ = random_.uniform() < faults.missed;
  told_cups_ = told.vacuum_on;
  ride();
  hold(now);
  take(now);
  sensors_.cup_vacuum_kpa.fill(0);
  if (!held_.empty()) std::fill_n(sensors_.cup_vacuum_kpa.begin(), world_.robot.tool.cups_m.size(), kSealed_kpa);
}

void Plant::ride() {
  const double by_m = kPeriod_s * sensors_.belt_speed_m_s;
  if (by_m == 0) return;
  std::erase_if(on_belt_, [&](Parcel* const parcel) {
    parcel->x_m += by_m;
    if (parcel->x_m < world_.belt.x_end_m) return false;
    parcel->where = Parcel::Where::kPlace;
    parcel->place = "exception";
    say_(fmt::format("{} rides off the belt", parcel->code));
    return true;
  });
}

void Plant::hold(Time) {
  if (held_.empty()) return;
  Parcel& parcel = parcels_.at(held_);
  parcel.was_lost = told_cups_ != 0;
  if (told_cups_ == 0) return leave(parcel, "let go of");
  const double per_s = is_astray(parcel, tip()) ? faults.lost_astray_per_s : faults.lost_per_s;
  if (random_.uniform() < per_s * kPeriod_s) {
    misses_ = true;
    leave(parcel, "lost");
  }
}

bool Plant::is_astray(const Parcel& parcel, const Vector3& tip) const {
  return std::ranges::any_of(world_.places, [&](const world::Place& place) {
    return place.kind == world::PlaceKind::kChute && place.name != parcel.destination && is_over(place, tip);
  });
}

void Plant::leave(Parcel& parcel, std::string_view how) {
  held_.clear();
  ++parcel.left;
  parcel.track = ++tracks_;
  if (when_left) when_left();
  const Vector3 from = tip();
  const world::Belt& belt = world_.belt;
  if (std::abs(from.y() - belt.y_center_m) < 0.5 * belt.width_m && from.x() < belt.x_end_m) {
    parcel.where = Parcel::Where::kBelt;
    parcel.x_m = beside_others(from.x());
    parcel.y_m = from.y();
    on_belt_.push_back(&parcel);
    say_(fmt::format("{} is {} over the belt, at {:.2f} m", parcel.code, how, from.x()));
    return;
  }
  parcel.where = Parcel::Where::kPlace;
  parcel.place = "tray";
  for (std::size_t i = 0; i < world_.places.size(); ++i) {
    const world::Place& place = world_.places[i];
    if (place.kind != world::PlaceKind::kChute && place.kind != world::PlaceKind::kException) continue;
    if (!is_over(place, from)) continue;
    parcel.place = place.name;
    ++sensors_.fallen_into[i];  // its light curtain
  }
  say_(fmt::format("{} is {} over {}", parcel.code, how, parcel.place));
}

// What falls onto another slides off it.
double Plant::beside_others(double x_m) const {
  const auto touches = [&](const Parcel* other) { return std::abs(other->x_m - x_m) < 2 * kBeside_m; };
  while (std::ranges::any_of(on_belt_, touches)) x_m += kBeside_m;
  return x_m;
}

std::optional<Vector3> Plant::top_of(const std::string& code) const {
  const auto parcel = std::ranges::find(on_belt_, code, &Parcel::code);
  if (parcel == on_belt_.end()) return std::nullopt;
  return Vector3((*parcel)->x_m, (*parcel)->y_m, world_.belt.surface_z_m + kParcelHeight_m);
}

void Plant::take(Time) {
  if (told_cups_ == 0 || !held_.empty() || misses_ || on_belt_.empty()) return;
  const Vector3 at = tip();
  if (std::abs(at.z() - world_.belt.surface_z_m - kParcelHeight_m) > kReach_m) return;
  for (Parcel* const parcel : on_belt_) {
    if (std::hypot(parcel->x_m - at.x(), parcel->y_m - at.y()) > kBeside_m) continue;
    held_ = parcel->code;
    parcel->where = Parcel::Where::kCups;
    ++parcel->taken;
    say_(fmt::format("the cups take {}", held_));
    std::erase(on_belt_, parcel);
    return;
  }
}

void Plant::put_on_belt(const std::string& code, const std::string& destination) {
  Parcel parcel{.code = code,
                .destination = destination,
                .track = ++tracks_,
                .x_m = world_.belt.x_start_m,
                .y_m = world_.belt.y_center_m};
  for (const Parcel* const other : on_belt_) parcel.x_m = std::min(parcel.x_m, other->x_m - kParcelLength_m - kGap_m);
  on_belt_.push_back(&parcels_.emplace(code, std::move(parcel)).first->second);
}

std::vector<ObjectBelief> Plant::beliefs(Time now) const {
  std::vector<ObjectBelief> beliefs;
  beliefs.reserve(on_belt_.size());
  for (const Parcel* const parcel : on_belt_) {
    if (parcel->x_m < world_.belt.x_start_m) continue;
    ObjectBelief& belief = beliefs.emplace_back();
    belief.track = parcel->track;
    belief.stamp = belief.last_seen = now;
    belief.world_from_top.translation() = Vector3(parcel->x_m, parcel->y_m, world_.belt.surface_z_m + kParcelHeight_m);
    belief.velocity_m_s.x() = sensors_.belt_speed_m_s;
    belief.size_m = {kParcelLength_m, kParcelWidth_m, kParcelHeight_m};
    belief.confidence = 1;
    belief.frames_seen = 100;
    belief.code = parcel->code;
  }
  return beliefs;
}

const Parcel* Plant::on_cups() const { return held_.empty() ? nullptr : &parcels_.at(held_); }

int Plant::printed(const std::string& task, int number) const {
  const auto found = printed_.find({task, number});
  return found == printed_.end() ? 0 : found->second;
}

}  // namespace pons::tests
