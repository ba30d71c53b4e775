#include "pons/sim/camera.hpp"

#include <cmath>
#include <cstring>

#include "pons/core/random.hpp"

namespace pons::sim {
namespace {

constexpr float kEdge_m = 0.012f;    // neighbours further apart in depth make an edge
constexpr double kEdgeDropout = 25;  // times the usual share there
constexpr double kMostEdgeDropout = 0.5;

// The finalizer of SplitMix64.
inline std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// Near enough to a normal number (the sum of four uniform ones, scaled to unit variance), and cheap enough for a
// million pixels.
inline float rough_normal(std::uint64_t bits) {
  const auto sum = static_cast<int>((bits & 0xffff) + ((bits >> 16) & 0xffff) + ((bits >> 32) & 0xffff) + (bits >> 48));
  return static_cast<float>(sum - 131070) * (1.7320508f / 65536.0f);
}

}  // namespace

Expected<std::unique_ptr<SimCamera>> SimCamera::create(const world::CameraSpec& spec, const mjModel* model,
                                                       mjData* data, int camera_id, const LabelStore* labels,
                                                       std::uint64_t seed) {
  auto renderer = Renderer::create(model, spec.width, spec.height, Look::kSensor);
  if (!renderer) return std::unexpected(renderer.error());
  std::unique_ptr<SimCamera> camera(new SimCamera);
  camera->spec_ = spec;
  camera->intrinsics_ = world::intrinsics(spec);
  camera->model_ = model;
  camera->data_ = data;
  camera->camera_id_ = camera_id;
  camera->labels_ = labels;
  camera->seed_ = Random(seed).fork(static_cast<std::uint64_t>(camera_id)).next();
  camera->renderer_ = std::move(*renderer);
  return camera;
}

void SimCamera::begin(Time now) {
  stamp_ = now;
  open_ = true;
  renderer_->capture(model_, data_, camera_id_, *labels_);
}

Expected<void> SimCamera::finish(RgbdFrame& frame) {
  if (!open_) return fail("finish() without begin()", spec_.name, "call begin() first");
  open_ = false;
  if (auto drawn = renderer_->draw(rgb_, buffer_); !drawn) return drawn;
  frame.camera = spec_.name;
  frame.stamp = stamp_;
  frame.intrinsics = intrinsics_;
  frame.world_from_optical = spec_.world_from_optical;
  const auto row_bytes = 3 * static_cast<std::size_t>(spec_.width);
  const auto rows = static_cast<std::size_t>(spec_.height);
  frame.rgb.resize(row_bytes * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    std::memcpy(frame.rgb.data() + row * row_bytes, rgb_.data() + (rows - 1 - row) * row_bytes, row_bytes);
  }
  measure_depth(frame.depth_m);
  return {};
}

void SimCamera::measure_depth(std::vector<float>& depth_m) const {
  const auto columns = static_cast<std::size_t>(spec_.width), rows = static_cast<std::size_t>(spec_.height);
  depth_m.resize(columns * rows);
  const auto near = static_cast<float>(renderer_->near_m());
  const auto slope = static_cast<float>(1 - renderer_->near_m() / renderer_->far_m());
  for (std::size_t row = 0; row < rows; ++row) {
    const float* from = buffer_.data() + (rows - 1 - row) * columns;
    float* to = depth_m.data() + row * columns;
    for (std::size_t column = 0; column < columns; ++column) to[column] = near / (1 - from[column] * slope);
  }
  const std::uint64_t frame_seed = mix(seed_ ^ (static_cast<std::uint64_t>(stamp_.ns()) * 0x9e3779b97f4a7c15ULL));
  const auto sigma = static_cast<float>(spec_.depth_noise_m);
  const auto limit = [](double share) { return static_cast<std::uint32_t>(share * 4294967295.0); };
  const std::uint32_t drop = limit(spec_.depth_dropout);
  const std::uint32_t edge_drop = limit(std::min(kMostEdgeDropout, kEdgeDropout * spec_.depth_dropout));
  for (std::size_t row = 0; row < rows; ++row) {
    float* line = depth_m.data() + row * columns;
    const float* below = row + 1 < rows ? line + columns : line;
    for (std::size_t column = 0; column < columns; ++column) {
      const float z = line[column];
      const float right = line[column + 1 < columns ? column + 1 : column];
      const bool edge = std::abs(right - z) > kEdge_m || std::abs(below[column] - z) > kEdge_m;
      const std::uint64_t bits = mix(frame_seed + (row * columns + column) * 0x9e3779b97f4a7c15ULL);
      const auto chance = static_cast<std::uint32_t>((bits * 0xd1342543de82ef95ULL) >> 32);
      const float measured = z + sigma * z * z * rough_normal(bits);
      line[column] = chance < (edge ? edge_drop : drop) ? 0.0f : measured;
    }
  }
}

}  // namespace pons::sim
