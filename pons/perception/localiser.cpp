#include "pons/perception/localiser.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

#include "pons/perception/shows.hpp"

namespace pons::perception {
namespace {

// Of the start's pose: somebody has put the base there.
constexpr double kStart_m = 0.05, kStart_rad = 0.03;
// Odometry, 1 σ: shares of what was driven and turned, and what each metre turns it by; wheels worn by some percent.
constexpr double kDriven = 0.03, kTurned = 0.05, kTurned_rad_m = 0.06;
// Always some, or the filter no longer hears the lidar.
constexpr double kLeast_m = 0.001, kLeast_rad = 0.001;
// A ray's end from the edge it shows, 1 σ: the lidar's noise, and the map's cells. Neighbours err alike: so many rays
// count as one.
constexpr double kEnd_m = 0.03;
constexpr double kAlike = 6;
constexpr double kOutlier_m = 0.12;  // from here on an end says less and less
constexpr int kSteps = 8;
constexpr double kConverged = 1e-5;  // m, rad
constexpr double kOnMap_m = 0.10;
constexpr double kUnmapped_m = 0.20;  // as far from any edge something else stands
// With fewer, or fewer that fit, a scan says nothing: the base is shut in, or lost.
constexpr int kFewest = 20;

}  // namespace

Localiser::Localiser(const world::World& world)
    : world_(world), lidar_(world.cameras.front()), drive_(*world.base), map_from_base_(world.base->start) {
  covariance_ = Vector3(kStart_m * kStart_m, kStart_m * kStart_m, kStart_rad * kStart_rad).asDiagonal();
}

void Localiser::process(const RgbdFrame& frame, const Moment& moment) {
  predict(moment.joint_position.of[0]);
  if (!shows_anything(frame)) return;  // what was believed grows old, until nobody goes by it
  take_ends(frame);
  if (static_cast<int>(ends_.size()) >= kFewest) correct();
  map_from_base_.yaw = wrapped(map_from_base_.yaw);
  belief_.emplace();
  belief_->stamp = frame.stamp;
  belief_->map_from_base = map_from_base_;
  belief_->covariance = covariance_;
  belief_->wheels_rad = moment.joint_position.of[0];
  belief_->ranges_m.assign(frame.depth_m.begin(), frame.depth_m.end());
  judge();
}

void Localiser::predict(const AxisVector& wheels) {
  if (wheels_) {
    const model::Twist2 way = drive_.twist(wheels - *wheels_);
    const Pose2 before = map_from_base_;
    map_from_base_ = model::DiffDrive::along(before, way);
    Eigen::Matrix3d moved = Eigen::Matrix3d::Identity();  // d(pose after) / d(pose before)
    moved(0, 2) = -(map_from_base_.y - before.y);
    moved(1, 2) = map_from_base_.x - before.x;
    const double ahead = kDriven * std::abs(way.ahead) + kLeast_m;
    const double turn = kTurned * std::abs(way.turn) + kTurned_rad_m * std::abs(way.ahead) + kLeast_rad;
    const double heading = (before.yaw + map_from_base_.yaw) / 2;
    const Vector3 along(std::cos(heading), std::sin(heading), 0), across(-std::sin(heading), std::cos(heading), 0);
    covariance_ = moved * covariance_ * moved.transpose() + ahead * ahead * along * along.transpose() +
                  kLeast_m * kLeast_m * across * across.transpose();
    covariance_(2, 2) += turn * turn;
  }
  wheels_ = wheels;
}

void Localiser::take_ends(const RgbdFrame& frame) {
  ends_.clear();
  const Pose2& at = lidar_.base_from_lidar;
  for (std::size_t i = 0; i < frame.depth_m.size(); ++i) {
    const double range_m = frame.depth_m[i];
    if (!(range_m > 0) || !std::isfinite(range_m)) continue;
    const double angle = (static_cast<double>(i) - frame.intrinsics.cx) / frame.intrinsics.fx;
    ends_.push_back(at * Vector2(range_m * std::cos(angle), range_m * std::sin(angle)));
  }
}

void Localiser::correct() {
  const world::Grid& map = *world_.map;
  const Pose2 predicted = map_from_base_;
  const Eigen::Matrix3d prior = covariance_.inverse();
  Eigen::Matrix3d information = prior;
  for (int step = 0; step < kSteps; ++step) {
    information = prior;
    Vector3 downhill = -prior * Vector3(map_from_base_.x - predicted.x, map_from_base_.y - predicted.y,
                                        map_from_base_.yaw - predicted.yaw);
    for (const Vector2& end : ends_) {
      const Vector2 on_map = map_from_base_ * end;
      if (!map.contains(on_map)) continue;
      const double off_m = map.distance_m(on_map);
      const double share = off_m / kOutlier_m;
      const double weight = 1 / (kAlike * kEnd_m * kEnd_m * (1 + share * share));
      const Vector2 uphill = map.gradient(on_map);
      const Vector2 arm = on_map - map_from_base_.position();
      const Vector3 slope(uphill.x(), uphill.y(), uphill.y() * arm.x() - uphill.x() * arm.y());
      information += weight * slope * slope.transpose();
      downhill -= weight * off_m * slope;
    }
    const Vector3 change = information.ldlt().solve(downhill);
    map_from_base_ = {map_from_base_.x + change.x(), map_from_base_.y + change.y(), map_from_base_.yaw + change.z()};
    if (change.cwiseAbs().maxCoeff() < kConverged) break;
  }
  covariance_ = information.inverse();
}

// Which rays end on the map, and what the others show.
void Localiser::judge() {
  int matched = 0;
  double nearest_m = lidar_.range_m;
  belief_->eye = map_from_base_ * lidar_.base_from_lidar.position();
  for (const Vector2& end : ends_) {
    const Vector2 on_map = map_from_base_ * end;
    belief_->ends.push_back(on_map);
    nearest_m = std::min(nearest_m, (end - lidar_.base_from_lidar.position()).norm());
    if (!world_.map->contains(on_map)) continue;
    const double off_m = world_.map->distance_m(on_map);
    if (std::abs(off_m) < kOnMap_m) ++matched;
    if (off_m > kUnmapped_m) belief_->unmapped.push_back(on_map);
  }
  belief_->returns = static_cast<int>(ends_.size());
  belief_->nearest_m = nearest_m;
  belief_->matched = ends_.empty() ? 0 : static_cast<double>(matched) / static_cast<double>(ends_.size());
}

}  // namespace pons::perception
