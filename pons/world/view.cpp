#include "pons/world/view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pons::world {

std::optional<Span> seen_of_belt(const CameraSpec& camera, const Belt& belt) {
  if (camera.watches != "belt") return std::nullopt;
  const double up = std::tan(camera.fovy_rad / 2);
  const double side = up * camera.width / camera.height;
  std::array<double, 4> x_m{}, y_m{};
  std::size_t corner = 0;
  for (const double x : {-side, side}) {
    for (const double y : {-up, up}) {
      const Vector3 ray = camera.world_from_optical.linear() * Vector3(x, y, 1);
      const Vector3 eye = camera.world_from_optical.translation();
      if (ray.z() >= 0 || eye.z() <= belt.surface_z_m) return std::nullopt;
      const double far = (belt.surface_z_m - eye.z()) / ray.z();
      x_m[corner] = eye.x() + ray.x() * far;
      y_m[corner++] = eye.y() + ray.y() * far;
    }
  }
  std::sort(x_m.begin(), x_m.end());
  std::sort(y_m.begin(), y_m.end());
  const bool over_belt = x_m[1] < belt.x_end_m && x_m[2] > belt.x_start_m &&
                         y_m[0] < belt.y_center_m + belt.width_m / 2 && y_m[3] > belt.y_center_m - belt.width_m / 2;
  if (!over_belt) return std::nullopt;
  return Span{x_m[1], x_m[2]};  // the inner ones of the corners on each side
}

}  // namespace pons::world
