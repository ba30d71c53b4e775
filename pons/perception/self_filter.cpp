#include "pons/perception/self_filter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace pons::perception {
namespace {

constexpr double kNearestSurface_m = 0.05;  // capsules closer to the lens are cut here: no division by zero
constexpr double kNearRing_m = 0.015;

double squared_distance_to_segment(const Eigen::Vector3f& point, const Eigen::Vector3f& from,
                                   const Eigen::Vector3f& along, float inverse_squared_length) {
  const Eigen::Vector3f offset = point - from;
  const float share = std::clamp(offset.dot(along) * inverse_squared_length, 0.0F, 1.0F);
  return (offset - share * along).squaredNorm();
}

}  // namespace

Sampling::Sampling(const Intrinsics& full, int wanted_width)
    : step(std::max(1, (full.width + wanted_width / 2) / wanted_width)),
      width((full.width + step - 1) / step),
      height((full.height + step - 1) / step),
      fx(full.fx / step),
      fy(full.fy / step),
      cx(full.cx / step),
      cy(full.cy / step) {}

SelfFilter::SelfFilter(model::RobotModel model, double margin_m) : model_(std::move(model)), margin_m_(margin_m) {}

const cv::Mat1b& SelfFilter::mask(const RgbdFrame& frame, const Sampling& sampling, const AxisVector& joint_position) {
  robot_.create(sampling.height, sampling.width);
  robot_.setTo(0);
  if (joint_position.size() == model_.axes()) {
    model_.place_capsules(joint_position, capsules_);
    for (const auto& capsule : capsules_) paint(frame, sampling, capsule);
  }
  const cv::Rect seen = cv::boundingRect(robot_);
  mask_.create(robot_.size());
  mask_.setTo(0);
  if (seen.empty()) return mask_;

  // Readings that dropped out inside the silhouette belong to the robot, too.
  cv::morphologyEx(robot_, robot_, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  const double distance_m = std::max(0.3, frame.world_from_optical.translation().z());
  const int ring = std::clamp(static_cast<int>(std::ceil(kNearRing_m * sampling.fx / distance_m)), 2, 25);
  cv::dilate(robot_, mask_, cv::getStructuringElement(cv::MORPH_RECT, {2 * ring + 1, 2 * ring + 1}));
  mask_.setTo(kNear, mask_);
  mask_.setTo(kRobot, robot_);
  return mask_;
}

void SelfFilter::paint(const RgbdFrame& frame, const Sampling& sampling, const model::PlacedCapsule& capsule) {
  const Pose optical_from_world = frame.world_from_optical.inverse();
  const Vector3 ends[2] = {optical_from_world * capsule.from, optical_from_world * capsule.to};
  const double radius_m = capsule.radius_m + margin_m_;
  if (std::max(ends[0].z(), ends[1].z()) + radius_m < kNearestSurface_m) return;

  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const Vector3& end : ends) {
    const double z = std::max(kNearestSurface_m, end.z() - radius_m);
    for (const double sign : {-1.0, 1.0}) {
      // Either the near or the far side of the sphere may reach further out in the picture.
      for (const double depth : {z, end.z() + radius_m}) {
        if (depth < kNearestSurface_m) continue;
        const double u = sampling.cx + sampling.fx * (end.x() + sign * radius_m) / depth;
        const double v = sampling.cy + sampling.fy * (end.y() + sign * radius_m) / depth;
        left = std::min(left, u), right = std::max(right, u);
        top = std::min(top, v), bottom = std::max(bottom, v);
      }
    }
  }
  const int u0 = std::max(0, cvFloor(std::clamp(left, -1e6, 1e6)));
  const int u1 = std::min(sampling.width - 1, cvCeil(std::clamp(right, -1e6, 1e6)));
  const int v0 = std::max(0, cvFloor(std::clamp(top, -1e6, 1e6)));
  const int v1 = std::min(sampling.height - 1, cvCeil(std::clamp(bottom, -1e6, 1e6)));

  const Eigen::Vector3f from = ends[0].cast<float>();
  const Eigen::Vector3f along = (ends[1] - ends[0]).cast<float>();
  const float inverse = 1.0F / std::max(1e-9F, along.squaredNorm());
  const auto inverse_fx = static_cast<float>(1 / sampling.fx), inverse_fy = static_cast<float>(1 / sampling.fy);
  for (int v = v0; v <= v1; ++v) {
    const float y = (static_cast<float>(v) - static_cast<float>(sampling.cy)) * inverse_fy;
    for (int u = u0; u <= u1; ++u) {
      const float depth = sampling.depth(frame, v, u);
      if (depth <= 0) continue;
      const float x = (static_cast<float>(u) - static_cast<float>(sampling.cx)) * inverse_fx;
      const Eigen::Vector3f point(x * depth, y * depth, depth);
      if (squared_distance_to_segment(point, from, along, inverse) <= radius_m * radius_m) robot_(v, u) = kRobot;
    }
  }
}

}  // namespace pons::perception
