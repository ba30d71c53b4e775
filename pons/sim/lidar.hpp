// A lidar of the simulation: rays cast into MuJoCo's scene, with a real one's faults. Private to pons/sim.
#pragma once

#include <cstdint>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/sim/mujoco_kit.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

// All rays of a scan go out at one moment: what turning adds while a real one's mirror goes round is left out. A range
// carries noise of 1 σ = depth_noise_m; a share of rays gets none. It depends on seed, stamp and ray alone.
class SimLidar final : public body::Camera {
 public:
  // `base_body` is what carries it: neither it nor what hangs on it is seen (geoms of its group). All must outlive it.
  SimLidar(const world::CameraSpec& spec, const mjModel* model, mjData* data, int base_body, std::uint64_t seed);

  [[nodiscard]] const Intrinsics& intrinsics() const override { return intrinsics_; }
  void begin(Time now) override;
  // Ranges in depth_m; no colours.
  [[nodiscard]] Expected<void> finish(RgbdFrame& frame) override;

 private:
  world::CameraSpec spec_;
  Intrinsics intrinsics_;
  const mjModel* model_;
  mjData* data_;
  int base_body_;
  std::uint64_t seed_;
  Time stamp_;
  std::vector<mjtNum> rays_, ranges_m_;
};

// What belongs to the base is in this group of geoms, everything else in others.
inline constexpr int kBaseGroup = 1;

}  // namespace pons::sim
