#include "pons/sim/lidar.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "pons/core/random.hpp"

namespace pons::sim {

SimLidar::SimLidar(const world::CameraSpec& spec, const mjModel* model, mjData* data, int base_body, std::uint64_t seed)
    : spec_(spec),
      intrinsics_(world::intrinsics(spec)),
      model_(model),
      data_(data),
      base_body_(base_body),
      seed_(seed),
      rays_(3 * static_cast<std::size_t>(spec.width)),
      ranges_m_(static_cast<std::size_t>(spec.width)) {}

void SimLidar::begin(Time now) {
  stamp_ = now;
  const mjtNum* base = data_->xmat + 9 * base_body_;
  const auto turned = [&](const Vector3& in_base) {
    return Vector3(base[0] * in_base.x() + base[1] * in_base.y() + base[2] * in_base.z(),
                   base[3] * in_base.x() + base[4] * in_base.y() + base[5] * in_base.z(),
                   base[6] * in_base.x() + base[7] * in_base.y() + base[8] * in_base.z());
  };
  const Pose2& at = spec_.base_from_lidar;
  const Vector3 eye =
      Eigen::Map<const Vector3>(data_->xpos + 3 * base_body_) + turned(Vector3(at.x, at.y, spec_.lidar_height_m));
  for (int i = 0; i < spec_.width; ++i) {
    const double angle = at.yaw + (i - intrinsics_.cx) / intrinsics_.fx;
    const Vector3 ray = turned(Vector3(std::cos(angle), std::sin(angle), 0));
    std::copy_n(ray.data(), 3, rays_.begin() + 3 * i);
  }
  std::array<mjtByte, mjNGROUP> groups;
  groups.fill(1);
  groups[kBaseGroup] = 0;
  mj_multiRay(model_, data_, eye.data(), rays_.data(), groups.data(), 1, -1, nullptr, ranges_m_.data(), nullptr,
              spec_.width, spec_.range_m);
}

Expected<void> SimLidar::finish(RgbdFrame& frame) {
  frame.camera = spec_.name;
  frame.stamp = stamp_;
  frame.intrinsics = intrinsics_;
  const auto rays = static_cast<std::size_t>(spec_.width);
  frame.rgb.resize(3 * rays);
  frame.depth_m.resize(rays);
  Random chance = Random(seed_).fork(static_cast<std::uint64_t>(stamp_.ns()));
  for (std::size_t i = 0; i < rays; ++i) {
    const bool lost = chance.uniform() < spec_.depth_dropout;
    const double measured = ranges_m_[i] + spec_.depth_noise_m * chance.normal();
    const bool far = ranges_m_[i] < 0 || measured > spec_.range_m;
    frame.depth_m[i] = lost || (!far && measured <= 0) ? 0.0F
                       : far                           ? std::numeric_limits<float>::infinity()
                                                       : static_cast<float>(measured);
  }
  return {};
}

}  // namespace pons::sim
