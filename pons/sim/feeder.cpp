#include "pons/sim/feeder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "pons/core/random.hpp"
#include "pons/sim/labels.hpp"
#include "pons/sim/parcels.hpp"
#include "pons/world/view.hpp"

namespace pons::sim {
namespace {

constexpr std::uint64_t kBeltStream = 0x62656c74, kSpoilStream = 0x73706f69;
constexpr double kStartMargin_m = 0.01;  // between the belt's start and the rear of what is put down
constexpr double kEyeHeight_m = 0.008;
constexpr double kEye_m = 0.02;     // downstream of where the cameras' view begins
constexpr double kJam_m = 0.06;     // a footprint's half diagonal says so much too much of its half length
constexpr double kHidden_m = 0.03;  // upstream of the view
constexpr double kTau = 2 * std::numbers::pi;

Vector3 position(const mjData* data, const Slot& slot) {
  return {data->qpos[slot.qpos], data->qpos[slot.qpos + 1], data->qpos[slot.qpos + 2]};
}

// Where the front of what is put down may lie without a camera seeing it appear.
double hidden_end_m(const world::World& world) {
  std::optional<double> view_m;
  for (const world::CameraSpec& camera : world.cameras) {
    if (const auto seen = world::seen_of_belt(camera, world.belt))
      view_m = std::min(view_m.value_or(seen->from_m), seen->from_m);
  }
  return view_m ? std::max(world.belt.x_start_m, *view_m - kHidden_m) : world.belt.x_start_m;
}

}  // namespace

BeltDrive::BeltDrive(const world::Belt& belt, std::uint64_t seed) : belt_(belt) {
  Random random = Random(seed).fork(kBeltStream);
  for (double& phase : phase_) phase = random.uniform(0, kTau);
}

void BeltDrive::step(mjModel* model, int geom, Time now, double step_s) {
  // Three sines without a common period; the weights sum to one, so the bounds hold.
  const double turn = kTau * now.s() / std::max(belt_.speed_period_s, 1e-3);
  const double wander = 0.55 * std::sin(turn + phase_[0]) + 0.30 * std::sin(1.618 * turn + phase_[1]) +
                        0.15 * std::sin(0.377 * turn + phase_[2]);
  const double change = belt_.ramp_m_s2 / belt_.speed_m_s * step_s;
  share_ += std::clamp(wanted_ - share_, -change, change);
  speed_m_s_ = share_ * belt_.speed_m_s * (1 + belt_.speed_variation * wander);
  travel_m_ += speed_m_s_ * step_s;
  model->geom_surfacevel[6 * geom] = speed_m_s_;
}

Feeder::Feeder(const world::World& world, const world::Manifest& manifest, std::vector<Arrival> arrivals)
    : world_(world), manifest_(manifest), arrivals_(std::move(arrivals)), hidden_end_m_(hidden_end_m(world)) {}

// Out of sight if the belt is long enough for that.
double Feeder::front_m(double length_m) const {
  return std::max(hidden_end_m_, world_.belt.x_start_m + kStartMargin_m + length_m);
}

void Feeder::step(const Composed& cell, mjModel* model, mjData* data, Ledger& ledger, LabelStore& labels,
                  const BeltDrive& belt, Time now) {
  for (const int slot : ledger.leaving()) park(model, data, cell.slots[static_cast<std::size_t>(slot)], slot);
  if (next_ >= manifest_.size()) return;
  // From the rear of the last to the front of the next.
  const double length_m = arrivals_[next_].group_length_m;
  const double needed = front_m(length_m) - last_rear_m_ + last_gap_m_;
  if (belt.travel_m() - last_travel_m_ < needed) return;
  if (!wanted(waiting(cell, data, ledger))) return;
  if (!room(cell, data, ledger, length_m)) return;
  last_gap_m_ = arrivals_[next_].gap_m;
  put_down(cell, model, data, ledger, labels, belt.speed_m_s(), now);
  last_travel_m_ = belt.travel_m();
  last_rear_m_ = front_m(length_m) - length_m;
}

// A group comes whole. One that would bring more than one too many waits until there are fewer.
bool Feeder::wanted(int waiting) const {
  const int most = world_.arrivals.waiting;
  return waiting == 0 || (waiting < most && waiting + static_cast<int>(group_size()) <= most + 1);
}

std::size_t Feeder::group_size() const {
  std::size_t end = next_;
  while (end < arrivals_.size() && arrivals_[end].group == arrivals_[next_].group) ++end;
  return end - next_;
}

int Feeder::waiting(const Composed& cell, const mjData* data, const Ledger& ledger) const {
  int count = 0;
  for (int i = 0; i < kSlots; ++i) {
    const Slot& slot = cell.slots[static_cast<std::size_t>(i)];
    if (ledger.on_belt(i) && position(data, slot).x() < world_.belt.pick_x_max_m) ++count;
  }
  return count;
}

bool Feeder::room(const Composed& cell, const mjData* data, const Ledger& ledger, double length_m) const {
  const double front = front_m(length_m);
  std::size_t free = 0;
  for (int i = 0; i < kSlots; ++i) {
    const int parcel = ledger.parcel_in(i);
    if (parcel < 0) {
      ++free;
      continue;
    }
    const Vector3 at = position(data, cell.slots[static_cast<std::size_t>(i)]);
    // A jam: what was put down before has not moved on.
    const double radius = 0.5 * manifest_[static_cast<std::size_t>(parcel)].size_m.head<2>().norm();
    if (ledger.on_belt(i) && at.x() - radius < front - kJam_m) return false;
  }
  return free >= group_size();
}

void Feeder::put_down(const Composed& cell, mjModel* model, mjData* data, Ledger& ledger, LabelStore& labels,
                      double speed_m_s, Time now) {
  const world::Belt& belt = world_.belt;
  const std::size_t end = next_ + group_size();
  int free = 0;
  for (; next_ < end; ++next_) {
    while (ledger.parcel_in(free) >= 0) ++free;
    const Arrival& arrival = arrivals_[next_];
    Pose world_from_group = Pose::Identity();
    world_from_group.translation() = Vector3(front_m(arrival.group_length_m), belt.y_center_m, belt.surface_z_m);
    const Pose world_from_middle = world_from_group * arrival.group_from_middle;
    activate(model, data, cell.slots[static_cast<std::size_t>(free)], manifest_[next_], arrival,
             world_.arrivals.label_m, world_from_middle, speed_m_s);
    LabelStore::Entry& label = labels.entries[static_cast<std::size_t>(free)];
    label.pixels = draw_label(arrival.label_text);
    if (arrival.label == LabelState::kDamaged) spoil_label(label.pixels, Random(next_).fork(kSpoilStream));
    ++label.version;
    if (!arrival.second_text.empty()) {
      LabelStore::Entry& second = labels.entries[static_cast<std::size_t>(kSlots + free)];
      second.pixels = draw_label(arrival.second_text);
      ++second.version;
    }
    ledger.offered(next_, free, now);
  }
}

bool Feeder::photo_eye(const Composed& cell, const mjData* data, const Ledger& ledger) const {
  const double from[3] = {hidden_end_m_ + kEye_m, world_.belt.y_center_m - 0.5 * world_.belt.width_m,
                          world_.belt.surface_z_m + kEyeHeight_m};
  const double along[3] = {0, world_.belt.width_m, 0};
  for (int i = 0; i < kSlots; ++i) {
    if (ledger.parcel_in(i) < 0) continue;
    const Slot& slot = cell.slots[static_cast<std::size_t>(i)];
    if (std::abs(data->qpos[slot.qpos] - from[0]) > 0.5) continue;
    for (const int geom : {slot.main, slot.rim}) {
      const mjModel* model = cell.model.get();
      if (model->geom_contype[geom] == 0) continue;
      const double hit = mju_rayGeom(data->geom_xpos + 3 * geom, data->geom_xmat + 9 * geom,
                                     model->geom_size + 3 * geom, from, along, model->geom_type[geom], nullptr);
      if (hit >= 0 && hit <= 1) return true;
    }
  }
  return false;
}

}  // namespace pons::sim
