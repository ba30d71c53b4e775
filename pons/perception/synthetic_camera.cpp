#include "pons/perception/synthetic_camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <qrcodegen/qrcodegen.hpp>

#include "pons/model/test_robots.hpp"

namespace pons::perception {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr double kLabel_m = 0.064;

struct Placed {
  const Thing* thing;
  Pose thing_from_world;
  std::vector<std::vector<bool>> modules;  // with quiet zone
};

double hit_box(const Vector3& from, const Vector3& ray, const Vector3& half) {
  double enter = -kFar, leave = kFar;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-half[axis] - from[axis]) / ray[axis], b = (half[axis] - from[axis]) / ray[axis];
    enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave && enter > 0 ? enter : kFar;
}

double hit_quadric(const Vector3& from, const Vector3& ray, const Vector3& weights) {
  const double a = ray.cwiseProduct(ray).dot(weights), b = 2 * from.cwiseProduct(ray).dot(weights);
  const double c = from.cwiseProduct(from).dot(weights) - 1;
  const double d = b * b - 4 * a * c;
  return d < 0 ? kFar : (-b - std::sqrt(d)) / (2 * a);
}

double hit(const Thing& thing, const Vector3& from, const Vector3& ray) {
  const Vector3 half = 0.5 * thing.size_m;
  if (thing.solid == Solid::kBox) return hit_box(from, ray, half);
  if (thing.solid == Solid::kBag) {
    const double t = hit_quadric(from, ray, half.cwiseAbs2().cwiseInverse());
    return t;
  }
  const double t = hit_quadric(from, ray, Vector3(0, 1 / (half.y() * half.y()), 1 / (half.z() * half.z())));
  return std::abs(from.x() + t * ray.x()) <= half.x() ? t : kFar;
}

std::vector<std::vector<bool>> modules_of(const std::string& code) {
  if (code.empty()) return {};
  const auto qr = qrcodegen::QrCode::encodeText(code.c_str(), qrcodegen::QrCode::Ecc::MEDIUM);
  const int side = qr.getSize() + 4;
  std::vector<std::vector<bool>> dark(static_cast<std::size_t>(side),
                                      std::vector<bool>(static_cast<std::size_t>(side)));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x)
      dark[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] = qr.getModule(x - 2, y - 2);
  }
  return dark;
}

std::array<std::uint8_t, 3> colour_at(const Placed& placed, const Vector3& at) {
  const Thing& thing = *placed.thing;
  if (placed.modules.empty() || at.z() < 0.5 * thing.size_m.z() - 1e-6) return thing.colour;
  const auto side = static_cast<double>(placed.modules.size());
  const double column = ((at.x() - thing.label_offset_m.x()) / kLabel_m + 0.5) * side;
  const double row = (0.5 - (at.y() - thing.label_offset_m.y()) / kLabel_m) * side;
  if (column < 0 || row < 0 || column >= side || row >= side) return thing.colour;
  const bool dark = placed.modules[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)];
  return dark ? std::array<std::uint8_t, 3>{20, 20, 20} : std::array<std::uint8_t, 3>{235, 235, 235};
}

}  // namespace

Vector3 Thing::top(double travel_m) const { return {x_m + (fixed ? 0 : travel_m), y_m, 0.9 + base_m + size_m.z()}; }

world::World belt_world() {
  world::World world;
  world.name = "test";
  world.robot = model::hanging_arm();
  world.belt = {-1.6, 1.0, 0.0, 0.5, 0.9, 0.25, 0.3, 7.0, -0.4, 0.45};
  world.rules.max_size_m = 0.40;
  world.places = {{"tray", world::PlaceKind::kTray, Vector3(0, 0, 0.95), Vector3(2.6, 0.6, 0.1)}};
  world::CameraSpec overhead;
  overhead.name = "overhead", overhead.watches = "belt";
  overhead.world_from_optical.translation() = Vector3(-0.5, 0.02, 2.55);
  overhead.world_from_optical.linear() = Eigen::AngleAxisd(3.14159265358979, Vector3::UnitX()).toRotationMatrix();
  overhead.width = 800, overhead.height = 352, overhead.fovy_rad = 0.3302;
  overhead.period_s = 0.2, overhead.latency_s = 0.08;
  world::CameraSpec label = overhead;
  label.name = "label", label.width = 1600, label.height = 704, label.period_s = 0.8, label.reads_labels = true;
  world::CameraSpec tray = overhead;
  tray.name = "tray", tray.watches = "tray", tray.width = 320, tray.height = 240, tray.fovy_rad = 0.9;
  world.cameras = {overhead, label, tray};
  return world;
}

RgbdFrame SyntheticBelt::render(const world::CameraSpec& camera) {
  RgbdFrame frame;
  frame.camera = camera.name, frame.stamp = now, frame.world_from_optical = camera.world_from_optical;
  const double focal = 0.5 * camera.height / std::tan(0.5 * camera.fovy_rad);
  frame.intrinsics = {camera.width, camera.height, focal, focal, 0.5 * (camera.width - 1), 0.5 * (camera.height - 1)};
  const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  frame.rgb.resize(3 * pixels), frame.depth_m.resize(pixels);

  std::vector<Placed> placed;
  for (const Thing& thing : things) {
    const Vector3 top = thing.top(travel_m);
    Pose pose = pose_xyz_yaw(top.x(), top.y(), top.z() - 0.5 * thing.size_m.z(), thing.yaw_rad);
    pose.linear() = pose.linear() * Eigen::AngleAxisd(thing.tilt_rad, Vector3::UnitY()).toRotationMatrix();
    placed.push_back({&thing, pose.inverse(), modules_of(thing.code)});
  }
  const Vector3 from = camera.world_from_optical.translation();
  std::size_t i = 0;
  for (int row = 0; row < camera.height; ++row) {
    for (int column = 0; column < camera.width; ++column, ++i) {
      const Vector3 ray = camera.world_from_optical.linear() *
                          Vector3((column - frame.intrinsics.cx) / focal, (row - frame.intrinsics.cy) / focal, 1);
      double depth = (world.belt.surface_z_m - from.z()) / ray.z();
      std::array<std::uint8_t, 3> colour = {60, 62, 64};
      if (depth <= 0 || std::abs(from.y() + depth * ray.y()) > 0.25) depth = -from.z() / ray.z(), colour = {90, 90, 90};
      for (const Placed& candidate : placed) {
        const Vector3 local_from = candidate.thing_from_world * from;
        const Vector3 local_ray = candidate.thing_from_world.linear() * ray;
        const double t = hit(*candidate.thing, local_from, local_ray);
        if (t >= depth) continue;
        depth = t;
        colour = colour_at(candidate, local_from + t * local_ray);
      }
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const double value = colour[channel] + 2.0 * random.normal();
        frame.rgb[3 * i + channel] = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
      }
      const bool lost = random.uniform() < dropout;
      frame.depth_m[i] = lost ? 0 : static_cast<float>(depth + noise_m * depth * depth * random.normal());
    }
  }
  return frame;
}

void SyntheticBelt::show(Perception& perception, const std::string& camera, const AxisVector& joints) {
  const auto spec = std::ranges::find(world.cameras, camera, &world::CameraSpec::name);
  perception.process(render(*spec), {joints, travel_m});
}

void SyntheticBelt::wait(double seconds) {
  now += from_s(seconds);
  travel_m += seconds * world.belt.speed_m_s;
}

void SyntheticBelt::watch(Perception& perception, int frames, const AxisVector& joints) {
  for (int i = 0; i < frames; ++i) {
    wait(0.2);
    show(perception, "overhead", joints);
  }
}

}  // namespace pons::perception
