#include "pons/sim/truth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>

#include "pons/sim/cell.hpp"
#include "pons/sim/simulation.hpp"

namespace pons::sim {
namespace {

constexpr double kSame_m = 1e-3, kSame_rad = 1e-3;  // two places that are one
constexpr double kStands_s = 1;                     // it stands that would not leave the place within so long

bool is_within(const Pose2& a, const Pose2& b, double share) {
  return (a.position() - b.position()).norm() <= share * kSame_m &&
         std::abs(wrapped(a.yaw - b.yaw)) <= share * kSame_rad;
}

bool stands(const BasePlace& before, const BasePlace& after) {
  return is_within(before.map_from_base, after.map_from_base, to_s(after.stamp - before.stamp) / kStands_s);
}

template <typename Places>
std::optional<Pose2> newest_by(const Places& places, Time time) {
  const auto after = std::ranges::upper_bound(places, time, {}, &BasePlace::stamp);
  return after == places.begin() ? std::nullopt : std::optional(std::prev(after)->map_from_base);
}

}  // namespace

void BaseWay::add(const BasePlace& place) {
  lately_.push_back(place);
  while (place.stamp - lately_.front().stamp > kWhole) {
    const BasePlace oldest = lately_.front();
    lately_.pop_front();
    const bool known = !stands_.empty() && is_within(stands_.back().map_from_base, oldest.map_from_base, 1);
    if (!known && stands(oldest, lately_.front())) stands_.push_back(oldest);
  }
}

std::optional<Pose2> BaseWay::at(Time time) const {
  const auto lately = newest_by(lately_, time);
  return lately ? lately : newest_by(stands_, time);
}

std::string_view name(LabelTruth label) {
  static constexpr std::array<std::string_view, 5> kNames{"readable", "down", "damaged", "unknown_code", "two_codes"};
  return kNames[static_cast<std::size_t>(label)];
}

std::string_view name(Whereabouts where) {
  static constexpr std::array<std::string_view, 8> kNames{"not_offered", "belt",      "held", "falling",
                                                          "chute",       "exception", "tray", "floor"};
  return kNames[static_cast<std::size_t>(where)];
}

Truth::Truth(const Simulation& simulation) : simulation_(&simulation) {}

const std::vector<ParcelTruth>& Truth::parcels() const { return simulation_->cell_->ledger.parcels(); }
const std::vector<ArmTruth>& Truth::arms() const { return simulation_->cell_->ledger.arms(); }
double Truth::least_between_arms_m() const { return simulation_->cell_->ledger.least_between_arms_m(); }

std::optional<Pose> Truth::top(std::size_t parcel) const {
  const Cell& cell = *simulation_->cell_;
  const int index = cell.ledger.slot_of(parcel);
  if (index < 0) return std::nullopt;
  const Slot& slot = cell.composed.slots[static_cast<std::size_t>(index)];
  const double* q = cell.data->qpos + slot.qpos;
  const ParcelTruth& truth = parcels()[parcel];
  Pose middle_from_top = Pose::Identity();
  const bool down = truth.label == LabelTruth::kDown;
  middle_from_top.translation().z() = (down ? -0.5 : 0.5) * truth.size_m.z();
  if (down) middle_from_top.rotate(Eigen::AngleAxisd(std::numbers::pi, Vector3::UnitX()));
  return from_mujoco(q, q + 3) * middle_from_top;
}

Vector3 Truth::velocity_m_s(std::size_t parcel) const {
  const Cell& cell = *simulation_->cell_;
  const int index = cell.ledger.slot_of(parcel);
  if (index < 0) return Vector3::Zero();
  const double* v = cell.data->qvel + cell.composed.slots[static_cast<std::size_t>(index)].dof;
  return {v[0], v[1], v[2]};
}

std::uint32_t Truth::cups_on() const {
  constexpr double kDriven_kpa = 4;  // half of what an open cup that is driven draws
  const Cell& cell = *simulation_->cell_;
  std::uint32_t on = 0;
  for (std::size_t i = 0; i < cell.arm().composed.cups.size(); ++i)
    on |= cell.arm().gripper.pressure_kpa(i) > kDriven_kpa ? 1U << i : 0U;
  return on;
}

Vector3 Truth::force_on_arm_n() const {
  const Cell& cell = *simulation_->cell_;
  const auto is_robot = [&](int geom) {
    const Part part = cell.composed.parts[static_cast<std::size_t>(geom)];
    return part == Part::kArm || part == Part::kCup;
  };
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < cell.data->ncon; ++i) {
    const mjContact& contact = cell.data->contact[i];
    if (is_robot(contact.geom[0]) == is_robot(contact.geom[1])) continue;
    double force[6];
    mj_contactForce(cell.composed.model.get(), cell.data.get(), i, force);
    // Of the first geom on the second, in the contact's frame, whose rows are its axes.
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> frame(contact.frame);
    const Vector3 on_second = frame.transpose() * Vector3(force[0], force[1], force[2]);
    sum += is_robot(contact.geom[1]) ? on_second : Vector3(-on_second);
  }
  return sum;
}

int Truth::on_belt() const {
  int count = 0;
  for (int i = 0; i < kSlots; ++i) count += simulation_->cell_->ledger.on_belt(i) ? 1 : 0;
  return count;
}

}  // namespace pons::sim
