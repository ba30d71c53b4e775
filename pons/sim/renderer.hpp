// One MuJoCo scene drawn offscreen to colour and depth. Private to pons/sim.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/sim/gl_context.hpp"
#include "pons/sim/mujoco_kit.hpp"

namespace pons::sim {

// The label textures now on the parcels, written by whoever advances the physics.
struct LabelStore {
  struct Entry {
    int texture = 0;                   // MuJoCo id
    std::uint64_t version = 0;         // grows with every change
    std::vector<std::uint8_t> pixels;  // RGB, top row first
  };
  std::vector<Entry> entries;  // one a slot
};

// How a picture is to look; sensors want speed, people want shadows.
enum class Look : std::uint8_t { kSensor, kPicture };

// capture() on the thread that advances the physics; draw() on any one thread, not at the same time. What draw() needs
// is copied in capture(), so the physics may go on in between.
class Renderer {
 public:
  // Errors: no OpenGL; a picture larger than the driver takes.
  [[nodiscard]] static Expected<std::unique_ptr<Renderer>> create(const mjModel* model, int width, int height,
                                                                  Look look);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  void capture(const mjModel* model, mjData* data, int camera, const LabelStore& labels);
  // Bottom row first. Colours as the driver keeps them, four bytes a pixel, the last without meaning: left to it, their
  // conversion costs four times their way out. Depth as in the buffer, 0 … 1.
  [[nodiscard]] Expected<void> draw(std::vector<std::uint8_t>& rgba, std::vector<float>& depth);
  // Metres along the optical axis from a buffer value d: near / (1 − d·(1 − near / far)).
  [[nodiscard]] double near_m() const { return near_m_; }
  [[nodiscard]] double far_m() const { return far_m_; }

 private:
  Renderer() = default;
  std::unique_ptr<GlContext> gl_;
  mjModel view_{};  // shallow: textures are our own copy, sizes of the buffer ours; the rest is the simulation's
  std::vector<mjtByte> texture_data_;
  std::vector<std::uint64_t> versions_;
  std::vector<int> changed_;  // textures to hand to OpenGL before drawing
  mjrContext context_{};
  mjvScene scene_{};
  mjvOption option_{};
  Look look_ = Look::kSensor;
  int width_ = 0, height_ = 0;
  double near_m_ = 0, far_m_ = 0;
};

// Red, green and blue of what draw() gave, to `rgb`, height × width × 3 bytes, top row first: its rows from `begin` to
// `end`.
void turn_over(const std::vector<std::uint8_t>& rgba, int width, int height, std::size_t begin, std::size_t end,
               std::uint8_t* rgb);

// What that camera sees, for people: height × width × 3 bytes, top row first. On the thread that advances the physics.
[[nodiscard]] Expected<std::vector<std::uint8_t>> draw_picture(const mjModel* model, mjData* data, int camera,
                                                               const LabelStore& labels, int width, int height);

}  // namespace pons::sim
