#include "pons/sim/parcels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace pons::sim {
namespace {

constexpr double kRimStep_m = 0.008;     // a bag's edges are that much thinner and its top that much smaller
constexpr double kLabelLift_m = 0.0006;  // above the surface
constexpr double kLabelHalf_m = 0.0002;
constexpr double kLabelMargin_m = 0.004;
constexpr double kWake_m_s = 1e-9;  // any speed wakes a sleeping body

std::array<double, 4> quaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

void set_geom(mjModel* model, int geom, mjtGeom type, const Vector3& half, const Vector3& position,
              const Eigen::Quaterniond& turn) {
  model->geom_type[geom] = type;
  model->geom_sameframe[geom] = mjSAMEFRAME_NONE;  // compiled without an offset, it would ignore one
  const auto q = quaternion(turn);
  for (int i = 0; i < 3; ++i) {
    model->geom_size[3 * geom + i] = half[i];
    model->geom_pos[3 * geom + i] = position[i];
    model->geom_aabb[6 * geom + i] = 0;
  }
  std::copy(q.begin(), q.end(), model->geom_quat + 4 * geom);
  // A cylinder's size is radius and half length; the other shapes' are half sides.
  const Vector3 box = type == mjGEOM_CYLINDER ? Vector3(half.x(), half.x(), half.y()) : half;
  for (int i = 0; i < 3; ++i) model->geom_aabb[6 * geom + 3 + i] = box[i];
  model->geom_rbound[geom] = box.norm();
}

void set_contact(mjModel* model, int geom, bool collides, world::ParcelKind kind) {
  model->geom_contype[geom] = collides ? 2 : 0;
  model->geom_conaffinity[geom] = collides ? 6 : 0;
  const bool tube = kind == world::ParcelKind::kTube;
  const bool bag = kind == world::ParcelKind::kBag;
  model->geom_condim[geom] = tube ? 6 : 4;
  model->geom_friction[3 * geom] = 0.6;
  model->geom_friction[3 * geom + 1] = 0.01;
  model->geom_friction[3 * geom + 2] = tube ? 0.004 : 0.0005;
  model->geom_solref[2 * geom] = bag ? 0.03 : 0.012;
  model->geom_solref[2 * geom + 1] = 1;
}

void set_color(mjModel* model, int geom, const std::array<float, 3>& color, float light, float alpha) {
  for (std::size_t i = 0; i < 3; ++i) {
    model->geom_rgba[4 * geom + static_cast<int>(i)] = std::min(1.0f, color[i] * light);
  }
  model->geom_rgba[4 * geom + 3] = alpha;
}

void set_mass(mjModel* model, const Slot& slot, double mass, const Vector3& inertia) {
  model->body_mass[slot.body] = mass;
  model->body_subtreemass[slot.body] = mass;
  const double mean_inverse = (1 / inertia.x() + 1 / inertia.y() + 1 / inertia.z()) / 3;
  model->body_invweight0[2 * slot.body] = 1 / mass;
  model->body_invweight0[2 * slot.body + 1] = mean_inverse;
  for (int i = 0; i < 3; ++i) {
    model->body_inertia[3 * slot.body + i] = inertia[i];
    model->dof_M0[slot.dof + i] = mass;
    model->dof_M0[slot.dof + 3 + i] = inertia[i];
    model->dof_invweight0[slot.dof + i] = 1 / mass;
    model->dof_invweight0[slot.dof + 3 + i] = mean_inverse;
  }
}

// One box round all of the body's geoms serves every node of its hierarchy.
void set_bounds(mjModel* model, const Slot& slot, const Vector3& half) {
  for (int node = model->body_bvhadr[slot.body]; node < model->body_bvhadr[slot.body] + model->body_bvhnum[slot.body];
       ++node) {
    for (int i = 0; i < 3; ++i) {
      model->bvh_aabb[6 * node + i] = 0;
      model->bvh_aabb[6 * node + 3 + i] = half[i] + 0.002;
    }
  }
}

Vector3 even_inertia(world::ParcelKind kind, const Vector3& size, double mass) {
  const Vector3 s = size.cwiseProduct(size);
  if (kind == world::ParcelKind::kTube) {
    const double r2 = 0.25 * s.z(), across = mass * (3 * r2 + s.x()) / 12;
    return {0.5 * mass * r2, across, across};
  }
  return mass / 12 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
}

void set_shape(mjModel* model, const Slot& slot, const world::ManifestRow& row, const Arrival& arrival) {
  const Vector3 half = 0.5 * row.size_m;
  const Eigen::Quaterniond along_x(Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitY()));
  const Eigen::Quaterniond straight = Eigen::Quaterniond::Identity();
  const bool bag = row.kind == world::ParcelKind::kBag;
  if (row.kind == world::ParcelKind::kTube) {
    set_geom(model, slot.main, mjGEOM_CYLINDER, Vector3(half.z(), half.x(), 0), Vector3::Zero(), along_x);
  } else {
    const double step = bag ? std::min(kRimStep_m, 0.25 * half.minCoeff()) : 0;
    set_geom(model, slot.main, mjGEOM_BOX, half - Vector3(step, step, 0), Vector3::Zero(), straight);
    set_geom(model, slot.rim, mjGEOM_BOX, half - Vector3(0, 0, step), Vector3::Zero(), straight);
  }
  set_contact(model, slot.main, true, row.kind);
  set_contact(model, slot.rim, bag, row.kind);
  set_color(model, slot.main, arrival.color, 1, 1);
  set_color(model, slot.rim, arrival.color, 0.92f, bag ? 1 : 0);
  if (!bag) set_geom(model, slot.rim, mjGEOM_BOX, Vector3::Constant(0.001), Vector3::Zero(), straight);
  set_bounds(model, slot, half);
}

double half_label_m(const world::ManifestRow& row, double label_m) {
  return std::min(0.5 * label_m, 0.96 * 0.5 * row.size_m.head<2>().minCoeff());
}

// Along the top, how far from its middle a label's middle may lie.
double label_room_m(const world::ManifestRow& row, double label_m) {
  const double edge =
      kLabelMargin_m + half_label_m(row, label_m) + (row.kind == world::ParcelKind::kBag ? kRimStep_m : 0);
  return std::max(0.0, 0.5 * row.size_m.x() - edge);
}

void set_label(mjModel* model, int geom, const world::ManifestRow& row, const Arrival& arrival, double label_m,
               const std::array<double, 2>& offset) {
  const Vector3 half = 0.5 * row.size_m;
  const double half_label = half_label_m(row, label_m);
  const double edge = kLabelMargin_m + half_label + (row.kind == world::ParcelKind::kBag ? kRimStep_m : 0);
  const double room_x = std::max(0.0, half.x() - edge), room_y = std::max(0.0, half.y() - edge);
  const double y = row.kind == world::ParcelKind::kTube ? 0 : offset[1] * room_y;
  const Vector3 position(offset[0] * room_x, y, half.z() + kLabelLift_m);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(arrival.label_turn * std::numbers::pi / 2, Vector3::UnitZ()));
  set_geom(model, geom, mjGEOM_BOX, Vector3(half_label, half_label, kLabelHalf_m), position, turn);
  model->geom_rgba[4 * geom + 3] = 1;
}

// Two share the top's length, one at each end.
void set_labels(mjModel* model, const Slot& slot, const world::ManifestRow& row, const Arrival& arrival,
                double label_m) {
  if (slot.second_label >= 0) model->geom_rgba[4 * slot.second_label + 3] = 0;
  if (arrival.second_text.empty()) return set_label(model, slot.label, row, arrival, label_m, arrival.label_offset);
  set_label(model, slot.label, row, arrival, label_m, {-1, arrival.label_offset[1]});
  set_label(model, slot.second_label, row, arrival, label_m, {1, arrival.label_offset[1]});
}

void set_state(mjData* data, const Slot& slot, const Pose& pose, double speed_m_s) {
  to_mujoco(pose, data->qpos + slot.qpos, data->qpos + slot.qpos + 3);
  std::fill_n(data->qvel + slot.dof, 6, 0.0);
  std::fill_n(data->qacc_warmstart + slot.dof, 6, 0.0);
  std::fill_n(data->qacc + slot.dof, 6, 0.0);
  data->qvel[slot.dof] = speed_m_s;
}

}  // namespace

void activate(mjModel* model, mjData* data, const Slot& slot, const world::ManifestRow& row, const Arrival& arrival,
              double label_m, const Pose& world_from_middle, double speed_m_s) {
  set_shape(model, slot, row, arrival);
  set_labels(model, slot, row, arrival, label_m);
  set_mass(model, slot, arrival.mass_kg, even_inertia(row.kind, row.size_m, arrival.mass_kg));
  model->body_gravcomp[slot.body] = 0;
  set_state(data, slot, world_from_middle, std::max(speed_m_s, kWake_m_s));
}

bool room_for_two_labels(const world::ManifestRow& row, double label_m) {
  return label_room_m(row, label_m) >= half_label_m(row, label_m) + kLabelMargin_m;
}

void wake(mjData* data, const Slot& slot) {
  double& speed = data->qvel[slot.dof];
  if (speed == 0) speed = kWake_m_s;
}

bool sleeps(const mjModel& model, const mjData& data, const Slot& slot) {
  return data.tree_asleep[model.body_treeid[slot.body]] >= 0;
}

void park(mjModel* model, mjData* data, const Slot& slot, int index) {
  for (const int geom : {slot.main, slot.rim, slot.label, slot.second_label}) {
    if (geom < 0) continue;
    model->geom_contype[geom] = model->geom_conaffinity[geom] = 0;
    model->geom_rgba[4 * geom + 3] = 0;
  }
  model->body_gravcomp[slot.body] = 1;
  set_state(data, slot, pose_xyz_yaw(40, 40 + 1.5 * index, 5, 0), kWake_m_s);
}

}  // namespace pons::sim
