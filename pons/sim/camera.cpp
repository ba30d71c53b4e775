#include "pons/sim/camera.hpp"

#include <algorithm>
#include <cmath>

#include "pons/core/random.hpp"

namespace pons::sim {
namespace {

constexpr float kEdge_m = 0.012f;    // neighbours further apart in depth make an edge
constexpr double kEdgeDropout = 25;  // times the usual share there
constexpr double kMostEdgeDropout = 0.5;
constexpr float kBefore_m = 0.5F;  // so far before the camera hangs what covers its view
constexpr std::uint8_t kGrey = 110;

// The finalizer of SplitMix64.
inline std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// Numbers drawn once. Each row of each frame reads them from another place on: a million pixels a picture are too many
// to draw for each one.
class Sheet {
 public:
  Sheet() : normal_(kSize), uniform_(kSize) {
    Random random(0);
    for (float& number : normal_) number = static_cast<float>(random.normal());
    for (std::uint32_t& number : uniform_) number = static_cast<std::uint32_t>(random.next() >> 32);
  }
  // For a row of so many pixels.
  [[nodiscard]] std::pair<const float*, const std::uint32_t*> from(std::uint64_t chance, std::size_t count) const {
    const std::size_t at = chance % (kSize - count);
    return {normal_.data() + at, uniform_.data() + at};
  }

 private:
  static constexpr std::size_t kSize = 1 << 16;  // both lie in a cache of 512 KiB; many times the widest picture
  std::vector<float> normal_;
  std::vector<std::uint32_t> uniform_;
};

struct Chance {
  std::uint64_t seed = 0;                 // of the frame
  float sigma = 0;                        // at 1 m
  std::uint32_t drop = 0, edge_drop = 0;  // of 2^32

  // True depths of a row and of the next one to measured ones. A loop without branches, which the compiler turns into
  // vector code.
  void disturb(const std::vector<float>& row, const std::vector<float>& below, std::uint64_t index, float* to) const {
    static const Sheet sheet;
    const auto [normal, uniform] = sheet.from(mix(seed + index * 0x9e3779b97f4a7c15ULL), row.size());
    const Chance own = *this;  // as a copy it cannot change with `to`
    const auto measure = [&](std::size_t i, float right) {
      const float z = row[i];
      const bool edge = (std::abs(right - z) > kEdge_m) | (std::abs(below[i] - z) > kEdge_m);
      const float measured = z + own.sigma * z * z * normal[i];
      to[i] = uniform[i] < (edge ? own.edge_drop : own.drop) ? 0.0F : measured;
    };
    const std::size_t last = row.size() - 1;
    for (std::size_t i = 0; i < last; ++i) measure(i, row[i + 1]);
    measure(last, row[last]);
  }
};

}  // namespace

Expected<std::unique_ptr<SimCamera>> SimCamera::create(const world::CameraSpec& spec, const mjModel* model,
                                                       mjData* data, int camera_id, const LabelStore* labels,
                                                       std::uint64_t seed, Faults* faults) {
  auto renderer = Renderer::create(model, spec.width, spec.height, Look::kSensor);
  if (!renderer) return std::unexpected(renderer.error());
  std::unique_ptr<SimCamera> camera(new SimCamera);
  camera->spec_ = spec;
  camera->intrinsics_ = world::intrinsics(spec);
  camera->model_ = model;
  camera->data_ = data;
  camera->camera_id_ = camera_id;
  camera->labels_ = labels;
  camera->faults_ = faults;
  camera->seed_ = Random(seed).fork(static_cast<std::uint64_t>(camera_id)).next();
  camera->renderer_ = std::move(*renderer);
  return camera;
}

void SimCamera::begin(Time now) {
  stamp_ = now;
  open_ = true;
  if (faults_ != nullptr) sight_ = faults_->sight(now);
  Eigen::Map<Vector3> stands(data_->cam_xpos + 3 * camera_id_);
  const Vector3 believed = stands;
  stands += sight_.shift_m;
  renderer_->capture(model_, data_, camera_id_, *labels_);
  stands = believed;
}

Expected<void> SimCamera::finish(RgbdFrame& frame) {
  if (!open_) return fail("finish() without begin()", spec_.name, "call begin() first");
  open_ = false;
  if (auto drawn = renderer_->draw(rgba_, buffer_); !drawn) return drawn;
  frame.camera = spec_.name;
  frame.stamp = stamp_;
  frame.intrinsics = intrinsics_;
  frame.world_from_optical = spec_.world_from_optical;
  const auto rows = static_cast<std::size_t>(spec_.height), pixels = rows * static_cast<std::size_t>(spec_.width);
  frame.rgb.resize(3 * pixels);
  frame.depth_m.resize(pixels);
  const auto measure = [&](std::size_t begin, std::size_t end) {
    turn_over(rgba_, spec_.width, spec_.height, begin, end, frame.rgb.data());
    measure_depth(begin, end, frame.depth_m);
  };
  both_([&] { measure(0, rows / 2); }, [&] { measure(rows / 2, rows); });
  spoil(frame);
  return {};
}

// What hangs before the camera is near, grey and without any pattern.
void SimCamera::spoil(RgbdFrame& frame) const {
  if (sight_.black) {
    std::fill_n(frame.rgb.data(), frame.rgb.size(), std::uint8_t{0});
    std::fill_n(frame.depth_m.data(), frame.depth_m.size(), 0.0F);
    return;
  }
  if (!sight_.hidden) return;
  const auto pixel = [](double share, int count) { return static_cast<std::size_t>(share * count); };
  const std::size_t left = pixel(sight_.hidden->left, spec_.width), right = pixel(sight_.hidden->right, spec_.width);
  const auto width = static_cast<std::size_t>(spec_.width);
  for (std::size_t row = pixel(sight_.hidden->top, spec_.height); row < pixel(sight_.hidden->bottom, spec_.height);
       ++row) {
    std::fill_n(frame.depth_m.data() + row * width + left, right - left, kBefore_m);
    std::fill_n(frame.rgb.data() + 3 * (row * width + left), 3 * (right - left), kGrey);
  }
}

void SimCamera::measure_depth(std::size_t begin, std::size_t end, PixelArray<float>& depth_m) const {
  const auto columns = static_cast<std::size_t>(spec_.width), rows = static_cast<std::size_t>(spec_.height);
  const auto near = static_cast<float>(renderer_->near_m());
  const auto slope = static_cast<float>(1 - renderer_->near_m() / renderer_->far_m());
  const auto true_depths = [&](std::size_t row, std::vector<float>& line) {
    const float* const from = buffer_.data() + (rows - 1 - row) * columns;
    for (std::size_t column = 0; column < columns; ++column) line[column] = near / (1 - from[column] * slope);
  };
  const auto of_all = [](double share) { return static_cast<std::uint32_t>(share * 4294967295.0); };
  const Chance chance{.seed = mix(seed_ ^ (static_cast<std::uint64_t>(stamp_.ns()) * 0x9e3779b97f4a7c15ULL)),
                      .sigma = static_cast<float>(spec_.depth_noise_m),
                      .drop = of_all(spec_.depth_dropout),
                      .edge_drop = of_all(std::min(kMostEdgeDropout, kEdgeDropout * spec_.depth_dropout))};
  std::vector<float> line(columns), below(columns);
  true_depths(begin, line);
  for (std::size_t row = begin; row < end; ++row) {
    if (row + 1 < rows) true_depths(row + 1, below);
    chance.disturb(line, row + 1 < rows ? below : line, row, depth_m.data() + row * columns);
    line.swap(below);
  }
}

}  // namespace pons::sim
