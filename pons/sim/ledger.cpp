#include "pons/sim/ledger.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "pons/sim/truth.hpp"
#include "pons/world/mouth.hpp"

namespace pons::sim {
namespace {

constexpr double kGravity = 9.81;
constexpr double kLifted_m = 0.02;  // risen so far in the grip of the cups: held
constexpr double kSinking_m_s = 0.25, kStopped_m_s = 0.15;
constexpr double kStill_m_s = 0.15;  // slower has come to rest, if it stays so
constexpr Duration kSettling = from_s(0.10);
constexpr Duration kInside = from_s(0.8);  // whatever moves in a chute that long is in it
constexpr Duration kChuteCarriesOff = from_s(1.2);
constexpr Duration kTrayCleared = from_s(6.0);   // long enough for the camera over it
constexpr Duration kStrayCleared = from_s(8.0);  // at rest where nothing belongs
constexpr double kRimSlack_m = 0.02;
constexpr double kWithinLimit = 1.001;
constexpr Duration kSameBreach = from_s(0.1);  // so long apart, what is beyond a limit has come back to it meanwhile
constexpr std::size_t kMostBreaches = 100;
constexpr double kFarApart_m = 1;   // arms further from each other are not measured
constexpr std::size_t kWindow = 5;  // steps of the mean acceleration at 2 ms

bool above(const world::Place& place, const Vector3& point) {
  const Vector3 d = (point - place.center_m).cwiseAbs();
  return d.x() <= 0.5 * place.size_m.x() && d.y() <= 0.5 * place.size_m.y();
}

// What the step's contacts say about one slot.
struct Touch {
  double press_n = 0, cups_n = 0, squeeze_n = 0;
};

struct Track {
  int parcel = -1;
  bool lifted = false, gripped = false, sinking = false;
  std::array<double, kWindow> press_n{};  // of the last steps
  double gripped_at_m = 0;                // height of the middle when the cups took hold
  double fell_from_m = 0;
  const world::Place* inside = nullptr;  // chute, exception or tray it is in
  Time since;                            // … or has been at rest outside of everything
  Time moved;                            // last time it was not still
  bool settled = false;
};

void note(ArmTruth& arm, Breach::Of of, int axis, double ratio, Time now) {
  const auto goes_on = [&](const Breach& last) {
    return last.of == of && last.axis == axis && now - last.to <= kSameBreach;
  };
  const auto last = std::find_if(arm.breaches.rbegin(), arm.breaches.rend(), goes_on);
  if (last != arm.breaches.rend()) {
    last->to = now;
    last->worst_ratio = std::max(last->worst_ratio, ratio);
  } else if (arm.breaches.size() < kMostBreaches) {
    arm.breaches.push_back({of, axis, now, now, ratio});
  }
}

}  // namespace

struct Ledger::Impl {
  world::World world;
  std::vector<ParcelTruth> parcels;
  std::vector<int> slot_of;
  std::vector<ArmTruth> arms;
  double least_between_arms_m = kFarApart_m;
  std::array<Track, kSlots> tracks;
  std::vector<int> leaving;
  int in_transit = 0;
  bool belt_stands = false;
  struct Speeds {
    AxisVector last;
    std::array<AxisVector, kWindow> window;
  };
  std::vector<Speeds> speeds;  // of each arm
  std::size_t window_at = 0;

  void feel(const Composed& cell, const mjData* data, std::span<const ArmStep> arms,
            std::array<Touch, kSlots>& touches) const;
  void follow_grip(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed,
                   std::span<const ArmStep> arms, int slot);
  void follow_fall(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed) const;
  void locate(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed, Time now) const;
  [[nodiscard]] const world::Place* place_around(const Vector3& at) const;
  [[nodiscard]] bool leaves(const Track& track, const ParcelTruth& parcel, Time now) const;
  void work(std::size_t arm, const mjData* data, const ArmStep& step, Time now);
  void keep_apart(const Composed& cell, mjData* data, std::span<const ArmStep> arms);
};

bool is_over(const world::Belt& belt, const Vector3& at) {
  return at.x() > belt.x_start_m && at.x() < belt.x_end_m && std::abs(at.y() - belt.y_center_m) < 0.5 * belt.width_m &&
         at.z() > belt.surface_z_m;
}

Ledger::Ledger(const world::World& world, const world::Manifest& manifest, const std::vector<Arrival>& arrivals)
    : impl_(std::make_unique<Impl>()) {
  impl_->world = world;
  impl_->arms.resize(world.arms().size());
  impl_->speeds.resize(world.arms().size());
  impl_->slot_of.assign(manifest.size(), -1);
  impl_->parcels.resize(manifest.size());
  for (std::size_t i = 0; i < manifest.size(); ++i) {
    ParcelTruth& parcel = impl_->parcels[i];
    parcel.parcel_id = manifest[i].parcel_id;
    parcel.destination = manifest[i].destination;
    parcel.label = static_cast<LabelTruth>(arrivals[i].label);
    parcel.shows = arrivals[i].label_text;
    if (!arrivals[i].second_text.empty() && arrivals[i].second_text != arrivals[i].label_text) {
      parcel.label = LabelTruth::kTwoCodes;
      parcel.shows = arrivals[i].second_text;
    }
    parcel.touching = arrivals[i].touching;
    parcel.mass_kg = arrivals[i].mass_kg;
    parcel.size_m = manifest[i].size_m;
    parcel.overweight = parcel.mass_kg > world.rules.max_mass_kg;
    const world::Place* const chute = world.place(parcel.destination);
    parcel.oversize = parcel.size_m.maxCoeff() > world.rules.max_size_m ||
                      (chute != nullptr && world::ways_in(parcel.size_m, *chute).empty());
    parcel.place = name(parcel.where);
  }
}

Ledger::~Ledger() = default;

void Ledger::offered(std::size_t parcel, int slot, Time now) {
  Track& track = impl_->tracks[static_cast<std::size_t>(slot)];
  track = Track{};
  track.parcel = static_cast<int>(parcel);
  track.moved = now;
  impl_->slot_of[parcel] = slot;
  ParcelTruth& truth = impl_->parcels[parcel];
  truth.offered = truth.arrived = now;
  truth.where = Whereabouts::kBelt;
  truth.place = name(truth.where);
  ++impl_->in_transit;
}

void Ledger::Impl::feel(const Composed& cell, const mjData* data, std::span<const ArmStep> steps,
                        std::array<Touch, kSlots>& touches) const {
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& contact = data->contact[i];
    for (std::size_t side = 0; side < 2; ++side) {
      const auto geom = static_cast<std::size_t>(contact.geom[side]);
      const auto other = static_cast<std::size_t>(contact.geom[1 - side]);
      const int slot = cell.slot_of_geom[geom];
      if (slot < 0) continue;
      const bool robot = cell.parts[other] == Part::kArm || cell.parts[other] == Part::kCup;
      const Track& track = tracks[static_cast<std::size_t>(slot)];
      if (!robot && !track.lifted) continue;
      double force[6];  // zero for a contact within the lips' gap: there adhesion alone acts
      mj_contactForce(cell.model.get(), data, i, force);
      Touch& touch = touches[static_cast<std::size_t>(slot)];
      if (!robot) {
        touch.squeeze_n = std::max(touch.squeeze_n, force[0]);
        continue;
      }
      // Adhesion presses lip and parcel together without pressing on the parcel as a whole.
      double pull = 0;
      for (const ArmStep& step : steps) {
        if (const auto cup = step.gripper.cup_of(contact.geom[1 - side])) pull = step.gripper.pull_n(*cup);
      }
      (pull > 0 ? touch.cups_n : touch.press_n) += force[0] - pull;
    }
  }
}

void Ledger::Impl::follow_grip(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed,
                               std::span<const ArmStep> steps, int slot) {
  const auto holder = std::ranges::find_if(steps, [&](const ArmStep& step) { return step.gripper.grip(slot) > 0; });
  if (holder != steps.end()) {
    if (!track.gripped) track.gripped_at_m = at.z();
    track.gripped = true;
    parcel.arm = static_cast<int>(holder - steps.begin());
    if (!track.lifted && at.z() - track.gripped_at_m > kLifted_m) {
      track.lifted = true;
      ++parcel.picks;
    }
    return;
  }
  if (track.lifted) {
    if (steps[static_cast<std::size_t>(parcel.arm)].vacuum_on != 0) ++parcel.drops;
    track.sinking = true;
    track.fell_from_m = at.z() + (speed.z() > 0 ? speed.z() * speed.z() / (2 * kGravity) : 0);
  }
  track.lifted = track.gripped = false;
}

void Ledger::Impl::follow_fall(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed) const {
  if (track.gripped) {
    track.sinking = false;
    return;
  }
  if (!track.sinking && speed.z() < -kSinking_m_s) {
    track.sinking = true;
    track.fell_from_m = at.z() + speed.z() * speed.z() / (2 * kGravity);
  } else if (track.sinking && speed.z() > -kStopped_m_s && at.z() < track.fell_from_m - 0.003) {
    track.sinking = false;
    parcel.max_drop_m = std::max(parcel.max_drop_m, track.fell_from_m - at.z());
  }
}

const world::Place* Ledger::Impl::place_around(const Vector3& at) const {
  const world::Place* tray = nullptr;  // under everything, so a chute goes first
  for (const world::Place& place : world.places) {
    if (!above(place, at)) continue;
    if (place.kind == world::PlaceKind::kChute || place.kind == world::PlaceKind::kException) {
      // Below a chute's floor is somewhere else.
      if (at.z() < place.center_m.z() + kRimSlack_m && at.z() > place.center_m.z() - place.size_m.z()) return &place;
    } else if (place.kind == world::PlaceKind::kTray && at.z() < place.center_m.z() + 0.5 * place.size_m.z() + 0.3) {
      tray = &place;
    }
  }
  return tray;
}

void Ledger::Impl::locate(Track& track, ParcelTruth& parcel, const Vector3& at, const Vector3& speed, Time now) const {
  const bool still = speed.norm() < kStill_m_s;
  if (!still) track.moved = now;
  const auto set = [&](Whereabouts where, std::string_view place) {
    if (parcel.where == where && parcel.place == place) return;
    parcel.where = where;
    parcel.place = place;
    parcel.arrived = now;
  };
  if (track.lifted) {
    track.inside = nullptr;
    track.moved = now;  // it belongs there, however long it hangs still: what is let go of is no stray
    return set(Whereabouts::kHeld, name(Whereabouts::kHeld));
  }
  const world::Place* around = place_around(at);
  if (around != track.inside) {
    track.inside = around;
    track.since = now;
  }
  if (around != nullptr) {
    const bool chute = around->kind != world::PlaceKind::kTray;
    const bool arrived = now - track.moved >= kSettling || (chute && now - track.since >= kInside);
    if (!arrived)
      return parcel.where == Whereabouts::kHeld || parcel.where == Whereabouts::kBelt
                 ? set(Whereabouts::kFalling, name(Whereabouts::kFalling))
                 : void();
    if (around->kind == world::PlaceKind::kChute) return set(Whereabouts::kChute, around->name);
    if (around->kind == world::PlaceKind::kException) return set(Whereabouts::kException, around->name);
    return set(Whereabouts::kTray, around->name);
  }
  const bool over_belt = is_over(world.belt, at);
  if (over_belt && belt_stands) track.moved = now;  // where it belongs, on a belt that does not move
  const bool stray = now - track.moved >= kStrayCleared || at.z() < 0.0;
  if (over_belt && !track.sinking && !stray) return set(Whereabouts::kBelt, name(Whereabouts::kBelt));
  if (stray) return set(Whereabouts::kFloor, name(Whereabouts::kFloor));
  if (!over_belt && parcel.where != Whereabouts::kFloor) set(Whereabouts::kFalling, name(Whereabouts::kFalling));
}

bool Ledger::Impl::leaves(const Track& track, const ParcelTruth& parcel, Time now) const {
  if (track.lifted) return false;
  switch (parcel.where) {
    case Whereabouts::kChute:
    case Whereabouts::kException:
      return now - parcel.arrived >= kChuteCarriesOff;
    case Whereabouts::kTray:
      return now - parcel.arrived >= kTrayCleared;
    case Whereabouts::kFloor:
      return true;
    default:
      return false;
  }
}

void Ledger::Impl::work(std::size_t index, const mjData* data, const ArmStep& step, Time now) {
  const AxisLimits& limits = world.arms()[index].robot.limits;
  const auto axes = static_cast<Eigen::Index>(step.composed.dof.size());
  const double step_s = world.physics_step_s;
  ArmTruth& arm = arms[index];
  auto& [last_speed, window] = speeds[index];
  AxisVector speed(axes);
  for (Eigen::Index i = 0; i < axes; ++i) speed[i] = data->qvel[step.composed.dof[static_cast<std::size_t>(i)]];
  if (arm.steps == 0) {
    last_speed = speed;
    window.fill(speed);
  }
  const auto worst = [](double& ratio, std::uint64_t* violations, double now_ratio) {
    ratio = std::max(ratio, now_ratio);
    if (violations != nullptr && now_ratio > kWithinLimit) ++*violations;
  };
  for (Eigen::Index i = 0; i < axes; ++i) {
    const double position = data->qpos[step.composed.qpos[static_cast<std::size_t>(i)]];
    const double outside = std::max(limits.position_min[i] - position, position - limits.position_max[i]);
    const double mean = (speed[i] - window[window_at][i]) / (static_cast<double>(kWindow) * step_s);
    const double speed_ratio = std::abs(speed[i]) / limits.speed_rad_s[i];
    const double torque_ratio = std::abs(step.torque_nm[i]) / limits.torque_nm[i];
    if (speed_ratio > kWithinLimit) note(arm, Breach::Of::kSpeed, static_cast<int>(i), speed_ratio, now);
    if (torque_ratio > kWithinLimit) note(arm, Breach::Of::kTorque, static_cast<int>(i), torque_ratio, now);
    worst(arm.worst_speed_ratio, &arm.speed_violations, speed_ratio);
    worst(arm.worst_acceleration_ratio, nullptr,
          std::abs(speed[i] - last_speed[i]) / step_s / limits.acceleration_rad_s2[i]);
    worst(arm.worst_mean_acceleration_ratio, &arm.acceleration_violations,
          std::abs(mean) / limits.acceleration_rad_s2[i]);
    worst(arm.worst_torque_ratio, &arm.torque_violations, torque_ratio);
    if (outside > 0) worst(arm.worst_position_ratio, nullptr, 1 + outside);
  }
  window[window_at] = speed;
  last_speed = speed;
  ++arm.steps;
}

// The least distance between any two arms, with their tools and what hangs on them.
void Ledger::Impl::keep_apart(const Composed& cell, mjData* data, std::span<const ArmStep> steps) {
  std::vector<std::vector<int>> geoms;
  for (const ArmStep& step : steps) {
    geoms.push_back(step.composed.geoms);
    for (std::size_t slot = 0; slot < kSlots; ++slot) {
      if (tracks[slot].lifted && step.gripper.grip(static_cast<int>(slot)) > 0)
        geoms.back().push_back(cell.slots[slot].main);
    }
  }
  const mjModel* model = cell.model.get();
  const auto near = [&](int one, int other) {
    const double apart_m = (Vector3::Map(data->geom_xpos + 3 * one) - Vector3::Map(data->geom_xpos + 3 * other)).norm();
    return apart_m - model->geom_rbound[one] - model->geom_rbound[other] < least_between_arms_m;
  };
  for (std::size_t i = 0; i < geoms.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      for (const int one : geoms[i]) {
        for (const int other : geoms[j]) {
          double between[6];
          if (near(one, other))
            least_between_arms_m =
                std::min(least_between_arms_m, mj_geomDistance(model, data, one, other, least_between_arms_m, between));
        }
      }
    }
  }
}

void Ledger::update(const Composed& cell, mjData* data, std::span<const ArmStep> arms, Time now) {
  for (std::size_t i = 0; i < arms.size(); ++i) impl_->work(i, data, arms[i], now);
  impl_->window_at = (impl_->window_at + 1) % kWindow;
  if (arms.size() > 1 && impl_->window_at == 0) impl_->keep_apart(cell, data, arms);
  impl_->belt_stands = cell.model->geom_surfacevel[6 * cell.belt_geom] == 0;
  impl_->leaving.clear();
  impl_->in_transit = 0;
  std::array<Touch, kSlots> touches{};
  impl_->feel(cell, data, arms, touches);
  for (std::size_t i = 0; i < kSlots; ++i) {
    Track& track = impl_->tracks[i];
    if (track.parcel < 0) continue;
    const Slot& slot = cell.slots[i];
    ParcelTruth& parcel = impl_->parcels[static_cast<std::size_t>(track.parcel)];
    const Vector3 at(data->qpos[slot.qpos], data->qpos[slot.qpos + 1], data->qpos[slot.qpos + 2]);
    const Vector3 speed(data->qvel[slot.dof], data->qvel[slot.dof + 1], data->qvel[slot.dof + 2]);
    track.press_n[impl_->window_at] = touches[i].press_n + std::max(0.0, touches[i].cups_n);
    const double press_n = std::accumulate(track.press_n.begin(), track.press_n.end(), 0.0) / kWindow;
    parcel.max_press_n = std::max(parcel.max_press_n, press_n);
    parcel.max_squeeze_n = std::max(parcel.max_squeeze_n, touches[i].squeeze_n);
    impl_->follow_grip(track, parcel, at, speed, arms, static_cast<int>(i));
    impl_->follow_fall(track, parcel, at, speed);
    impl_->locate(track, parcel, at, speed, now);
    if (parcel.where == Whereabouts::kBelt || parcel.where == Whereabouts::kHeld ||
        parcel.where == Whereabouts::kFalling) {
      ++impl_->in_transit;
    }
    if (!impl_->leaves(track, parcel, now)) continue;
    impl_->leaving.push_back(static_cast<int>(i));
    impl_->slot_of[static_cast<std::size_t>(track.parcel)] = -1;
    track.parcel = -1;
  }
}

const std::vector<int>& Ledger::leaving() const { return impl_->leaving; }
int Ledger::parcel_in(int slot) const { return impl_->tracks[static_cast<std::size_t>(slot)].parcel; }
int Ledger::slot_of(std::size_t parcel) const { return impl_->slot_of[parcel]; }
bool Ledger::on_belt(int slot) const {
  const Track& track = impl_->tracks[static_cast<std::size_t>(slot)];
  return track.parcel >= 0 && impl_->parcels[static_cast<std::size_t>(track.parcel)].where == Whereabouts::kBelt;
}
bool Ledger::lifted(int slot) const { return impl_->tracks[static_cast<std::size_t>(slot)].lifted; }
std::size_t Ledger::size() const { return impl_->parcels.size(); }
int Ledger::in_transit() const { return impl_->in_transit; }
const std::vector<ParcelTruth>& Ledger::parcels() const { return impl_->parcels; }
const std::vector<ArmTruth>& Ledger::arms() const { return impl_->arms; }
double Ledger::least_between_arms_m() const { return impl_->least_between_arms_m; }

}  // namespace pons::sim
