#include "pons/sim/check_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace pons::sim {
namespace {

constexpr double kSame_m = 1e-4;
constexpr double kAbove_m = 0.05;                    // where the plumb line begins, over the rim
constexpr double kInset_m = 0.02;                    // of the corners of a mouth
constexpr double kShallowest = 0.5, kDeepest = 1.5;  // of the depth that world.yaml gives
constexpr std::array<mjtByte, mjNGROUP> kAllGroups{1, 1, 1, 1, 1, 1};

bool same(double a, double b) { return std::abs(a - b) <= kSame_m; }

Expected<void> check_belt(const mjModel* model, const mjData* data, int geom, const world::World& world) {
  const std::string& file = world.scene_mjcf.string();
  const double *at = data->geom_xpos + 3 * geom, *turned = data->geom_xmat + 9 * geom,
               *half = model->geom_size + 3 * geom;
  if (model->geom_type[geom] != mjGEOM_BOX || turned[0] < 1 - kSame_m || turned[8] < 1 - kSame_m)
    return fail("geom 'belt' is not a box along the axes of the world", file, "make it one, and turn nothing");
  const world::Belt& belt = world.belt;
  if (!same(at[2] + half[2], belt.surface_z_m) || !same(at[0] - half[0], belt.x_start_m) ||
      !same(at[0] + half[0], belt.x_end_m)) {
    return fail("geom 'belt' is not where world.yaml has the belt", file,
                "make x_start_m, x_end_m and surface_z_m of world.yaml agree with the geom");
  }
  if (!same(at[1], belt.y_center_m) || !same(2 * half[1], belt.width_m)) {
    return fail("geom 'belt' does not lie across as world.yaml says", file,
                "make y_center_m and width_m of world.yaml agree with the geom");
  }
  const double* speed = model->geom_surfacevel + 6 * geom;
  const bool along = speed[0] > 0 && std::all_of(speed + 1, speed + 6, [](double part) { return part == 0; });
  if (!along) return fail("geom 'belt' has no surfacevel along +x, or another beside it", file, "write V 0 0 0 0 0");
  return {};
}

// A plumb line from above a point of the mouth must find the floor, at about the depth that is claimed.
Expected<void> check_mouth(const mjModel* model, const mjData* data, const world::Place& place,
                           const world::World& world) {
  const double x = place.size_m.x() / 2 - kInset_m, y = place.size_m.y() / 2 - kInset_m, depth = place.size_m.z();
  const std::array<Vector3, 5> points{{{0, 0, 0}, {x, y, 0}, {x, -y, 0}, {-x, y, 0}, {-x, -y, 0}}};
  const Vector3 down(0, 0, -1);
  for (const Vector3& point : points) {
    const Vector3 from = place.center_m + point + Vector3(0, 0, kAbove_m);
    int geom = -1;
    const double found = mj_ray(model, data, from.data(), down.data(), kAllGroups.data(), 1, -1, &geom, nullptr);
    const double below = found - kAbove_m;
    if (found >= 0 && below >= kShallowest * depth && below <= kDeepest * depth) continue;
    const std::string name = geom < 0 ? "" : model->names + model->name_geomadr[geom];
    const std::string what =
        found < 0 ? "there is nothing"
                  : fmt::format("{} is {:.2f} m below its rim, not {:.2f}",
                                name.empty() ? "something without a name" : "'" + name + "'", below, depth);
    return fail(fmt::format("the mouth of '{}' is not in the scene: at ({:.2f}, {:.2f}) {}", place.name, from.x(),
                            from.y(), what),
                world.scene_mjcf.string(), "make center and size of the place agree with the geoms there");
  }
  return {};
}

}  // namespace

Expected<void> check_scene(const Composed& cell, const world::World& world) {
  const mjModel* model = cell.model.get();
  const DataPtr data(mj_makeData(model));
  for (const ComposedArm& arm : cell.arms) {
    for (std::size_t axis = 0; axis < arm.qpos.size(); ++axis)
      data->qpos[arm.qpos[axis]] = world.robot.home[static_cast<Eigen::Index>(axis)];
  }
  mj_kinematics(model, data.get());
  if (auto belt = check_belt(model, data.get(), cell.belt_geom, world); !belt) return belt;
  for (const world::Place& place : world.places) {
    if (place.kind != world::PlaceKind::kChute && place.kind != world::PlaceKind::kException) continue;
    if (auto open = check_mouth(model, data.get(), place, world); !open) return open;
  }
  return {};
}

}  // namespace pons::sim
