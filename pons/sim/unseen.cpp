#include "pons/sim/unseen.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

namespace pons::sim {
namespace {

using Eigen::Vector3f;

constexpr float kLarge_m = 0.5F;     // half a side: what is smaller hides little
constexpr float kSurely_m = 0.001F;  // so far within what is hidden

Vector3f vector(const float v[3]) { return {v[0], v[1], v[2]}; }

// Everything is relative to the camera.
struct View {
  Vector3f eye;
  Vector3f forward;
  float near_m;
  std::array<Vector3f, 4> corners;  // directions to those of the picture, around it
};

View view_of(const mjvGLCamera& camera, float aspect) {
  const Vector3f forward = vector(camera.forward), up = vector(camera.up), right = forward.cross(up);
  const float near = camera.frustum_near;
  const float side = 0.5F * aspect * (camera.frustum_top - camera.frustum_bottom);
  const auto corner = [&](float x, float y) -> Vector3f { return near * forward + x * right + y * up; };
  return {vector(camera.pos),
          forward,
          near,
          {corner(-side, camera.frustum_bottom), corner(side, camera.frustum_bottom), corner(side, camera.frustum_top),
           corner(-side, camera.frustum_top)}};
}

// A convex cone from the camera: the unit normals, inward, of its four sides.
using Cone = std::array<Vector3f, 4>;

Cone cone_through(std::span<const Vector3f, 4> corners) {
  Vector3f middle = Vector3f::Zero();
  for (const Vector3f& corner : corners) middle += corner;
  Cone cone;
  for (std::size_t i = 0; i < 4; ++i) {
    cone[i] = corners[i].cross(corners[(i + 1) % 4]).normalized();
    if (cone[i].dot(middle) < 0) cone[i] = -cone[i];
  }
  return cone;
}

bool outside(const Cone& view, const Vector3f& middle, float radius) {
  return std::ranges::any_of(view, [&](const Vector3f& inward) { return inward.dot(middle) < -radius; });
}

// A face of a box that hides what lies in its cone beyond it.
struct Screen {
  Cone cone;
  Vector3f normal;  // towards the camera
  float at_m;       // along it

  [[nodiscard]] bool hides(const Vector3f& point) const {
    return normal.dot(point) < at_m - kSurely_m &&
           std::ranges::all_of(cone, [&](const Vector3f& inward) { return inward.dot(point) > kSurely_m; });
  }
};

Eigen::Matrix3f axes_of(const mjvGeom& geom) {
  return Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(geom.mat);
}

void add_screens(const mjvGeom& geom, const View& view, std::vector<Screen>& screens) {
  const Vector3f half = vector(geom.size), middle = vector(geom.pos) - view.eye;
  if (geom.type != mjGEOM_BOX || geom.rgba[3] < 1 || half.maxCoeff() < kLarge_m) return;
  const Eigen::Matrix3f axes = axes_of(geom);
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      const Vector3f normal = sign * axes.col(axis), face = middle + half[axis] * normal;
      if (normal.dot(face) >= 0) continue;  // turned away
      const Vector3f u = axes.col((axis + 1) % 3) * half[(axis + 1) % 3];
      const Vector3f v = axes.col((axis + 2) % 3) * half[(axis + 2) % 3];
      const std::array<Vector3f, 4> corners{face - u - v, face + u - v, face + u + v, face - u + v};
      const auto before = [&](const Vector3f& corner) { return view.forward.dot(corner) > view.near_m; };
      if (!std::ranges::all_of(corners, before)) continue;
      screens.push_back({cone_through(corners), normal, normal.dot(face)});
    }
  }
}

// Whoever does not see these sees nothing of the geom; nothing: they cannot be told.
std::optional<std::vector<Vector3f>> extremes(const mjvGeom& geom, float radius, const View& view) {
  const Vector3f middle = vector(geom.pos) - view.eye;
  const Eigen::Matrix3f axes = axes_of(geom);
  std::vector<Vector3f> points;
  if (geom.type == mjGEOM_PLANE) {  // as far as the picture reaches
    const Vector3f normal = axes.col(2);
    for (const Vector3f& corner : view.corners) {
      const float share = normal.dot(middle) / normal.dot(corner);
      if (!(share > 0)) return std::nullopt;
      points.emplace_back(share * corner);
    }
    return points;
  }
  if (geom.type != mjGEOM_BOX && radius <= 0) return std::nullopt;
  const Vector3f half = geom.type == mjGEOM_BOX ? vector(geom.size) : Vector3f::Constant(radius);
  for (const float x : {-1.0F, 1.0F}) {
    for (const float y : {-1.0F, 1.0F}) {
      for (const float z : {-1.0F, 1.0F}) points.emplace_back(middle + axes * Vector3f(x, y, z).cwiseProduct(half));
    }
  }
  return points;
}

}  // namespace

void leave_out_unseen(const mjModel* model, const mjvGLCamera& camera, float aspect, mjvScene& scene) {
  const View view = view_of(camera, aspect);
  const Cone picture = cone_through(view.corners);
  const std::span<mjvGeom> geoms(scene.geoms, static_cast<std::size_t>(scene.ngeom));
  std::vector<Screen> screens;
  for (const mjvGeom& geom : geoms) add_screens(geom, view, screens);
  const auto unseen = [&](const mjvGeom& geom) {
    if (geom.objtype != mjOBJ_GEOM) return false;
    const auto radius = static_cast<float>(model->geom_rbound[geom.objid]);  // of an infinite one 0
    if (radius > 0 && outside(picture, vector(geom.pos) - view.eye, radius)) return true;
    const auto points = extremes(geom, radius, view);
    return points && std::ranges::any_of(screens, [&](const Screen& screen) {
             return std::ranges::all_of(*points, [&](const Vector3f& point) { return screen.hides(point); });
           });
  };
  scene.ngeom = static_cast<int>(std::ranges::remove_if(geoms, unseen).begin() - geoms.begin());
}

}  // namespace pons::sim
