// Where a base is on a known map: odometry, corrected by each scan of its lidar. Never in the loop.
//
// An iterated extended Kalman filter. Between scans the wheels tell how the base moved, and the covariance grows with
// what they turned. A scan is fitted to the map's likelihood field (Thrun, Burgard, Fox 2005, Probabilistic Robotics,
// 6.4: what counts is how far each ray's end is from the nearest edge) by Gauss-Newton steps from the prediction, which
// weighs in with its covariance (Bell and Cathey 1993); rays that end far from any edge lose their weight (Cauchy).
#pragma once

#include "pons/model/diff_drive.hpp"
#include "pons/perception/sight.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// Deterministic; one thread. `world` must outlive it and have a base.
class Localiser final : public Sight {
 public:
  // Believes the base where the world's file has it start.
  explicit Localiser(const world::World& world);

  // A scan, and what the wheels had turned when it was taken.
  void process(const RgbdFrame& frame, const Moment& moment) override;
  // As of the newest scan; nothing before the first.
  [[nodiscard]] std::optional<BaseBelief> base() const override { return belief_; }

 private:
  void predict(const AxisVector& wheels);
  void take_ends(const RgbdFrame& frame);
  void correct();
  void judge();

  const world::World& world_;
  const world::CameraSpec& lidar_;
  const model::DiffDrive drive_;
  Pose2 map_from_base_;
  Eigen::Matrix3d covariance_;
  std::optional<AxisVector> wheels_;  // at the last scan
  std::vector<Vector2> ends_;         // of the scan's rays that came back, base frame
  std::optional<BaseBelief> belief_;
};

}  // namespace pons::perception
