// A colour-and-depth camera of the simulation with a real one's faults. Private to pons/sim.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/both.hpp"
#include "pons/sim/faults.hpp"
#include "pons/sim/renderer.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

// Depth carries noise of 1 σ = depth_noise_m · z² and lacks readings: a share everywhere, far more where depth jumps.
// All of it depends on seed, camera, time stamp and pixel alone.
class SimCamera final : public body::Camera {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<SimCamera>> create(const world::CameraSpec& spec, const mjModel* model,
                                                                   mjData* data, int camera_id,
                                                                   const LabelStore* labels, std::uint64_t seed,
                                                                   Faults* faults = nullptr);

  [[nodiscard]] const Intrinsics& intrinsics() const override { return intrinsics_; }
  void begin(Time now) override;
  [[nodiscard]] Expected<void> finish(RgbdFrame& frame) override;
  // What finish() has the other half of a picture done by; before the first begin().
  void lend(Both both) { both_ = std::move(both); }

 private:
  SimCamera() = default;
  // Of the rows from `begin` to `end`.
  void measure_depth(std::size_t begin, std::size_t end, PixelArray<float>& depth_m) const;
  void spoil(RgbdFrame& frame) const;

  world::CameraSpec spec_;
  Intrinsics intrinsics_;
  const mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
  int camera_id_ = 0;
  const LabelStore* labels_ = nullptr;
  std::uint64_t seed_ = 0;
  std::unique_ptr<Renderer> renderer_;
  Faults* faults_ = nullptr;  // that come over it; none: null
  Sight sight_;               // of the open shutter
  Time stamp_;
  bool open_ = false;
  Both both_ = one_after_the_other;
  std::vector<std::uint8_t> rgba_;  // bottom row first, as the renderer gives them
  std::vector<float> buffer_;
};

}  // namespace pons::sim
