#include "pons/world/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pons::world {

std::optional<Span> seen_of_belt(const CameraSpec& camera, const Belt& belt) {
  if (camera.watches != "belt") return std::nullopt;
  const double up = std::tan(camera.fovy_rad / 2);
  const double side = up * camera.width / camera.height;
  std::array<double, 4> x_m{};
  std::size_t corner = 0;
  for (const double x : {-side, side}) {
    for (const double y : {-up, up}) {
      const Vector3 ray = camera.world_from_optical.linear() * Vector3(x, y, 1);
      const Vector3 eye = camera.world_from_optical.translation();
      if (ray.z() >= 0 || eye.z() <= belt.surface_z_m) return std::nullopt;
      x_m[corner++] = eye.x() + ray.x() * (belt.surface_z_m - eye.z()) / ray.z();
    }
  }
  std::sort(x_m.begin(), x_m.end());
  return Span{x_m[1], x_m[2]};  // the inner ones of the corners on each side
}

}  // namespace pons::world
