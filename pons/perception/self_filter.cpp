#include "pons/perception/self_filter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace pons::perception {
namespace {

constexpr double kNearestSurface_m = 0.05;  // capsules closer to the lens are cut here: no division by zero
// How far beyond its capsules the robot may reach: fingers of hoses, calibration, the bellows' play.
constexpr double kMargin_m = 0.025;
constexpr double kNearRing_m = 0.015;
constexpr int kHole = 5;  // samples

}  // namespace

Sampling::Sampling(const Intrinsics& full, int wanted_width)
    : step(std::max(1, (full.width + wanted_width / 2) / wanted_width)),
      width((full.width + step - 1) / step),
      height((full.height + step - 1) / step),
      fx(full.fx / step),
      fy(full.fy / step),
      cx(full.cx / step),
      cy(full.cy / step) {}

SelfFilter::SelfFilter(model::RobotModel model, Both both) : both_(std::move(both)) { add(std::move(model)); }

const cv::Mat1b& SelfFilter::mask(const RgbdFrame& frame, const Sampling& sampling,
                                  const ArmPositions& joint_position) {
  robot_.create(sampling.height, sampling.width);
  robot_.setTo(0);
  shapes_.clear();
  const Pose optical_from_world = frame.world_from_optical.inverse();
  for (std::size_t robot = 0; robot < models_.size(); ++robot) {
    if (joint_position.of[robot].size() != models_[robot].axes()) continue;
    models_[robot].place_capsules(joint_position.of[robot], capsules_);
    for (const auto& capsule : capsules_) shapes_.push_back(shape_of(capsule, optical_from_world, sampling));
  }
  const int middle = sampling.height / 2;
  both_([&] { paint(frame, sampling, 0, middle); }, [&] { paint(frame, sampling, middle, sampling.height); });
  const cv::Rect seen = cv::boundingRect(robot_);
  mask_.create(robot_.size());
  mask_.setTo(0);
  if (seen.empty()) return mask_;

  const double distance_m = std::max(0.3, frame.world_from_optical.translation().z());
  const int ring = std::clamp(static_cast<int>(std::ceil(kNearRing_m * sampling.fx / distance_m)), 2, 25);
  const int reach = ring + kHole;
  const cv::Rect around = cv::Rect(seen.tl() - cv::Point(reach, reach), seen.br() + cv::Point(reach, reach)) &
                          cv::Rect(cv::Point(0, 0), robot_.size());
  cv::Mat1b robot = robot_(around), mask = mask_(around);
  // Readings that dropped out inside the silhouette belong to the robot, too.
  cv::morphologyEx(robot, robot, cv::MORPH_CLOSE, cv::getStructuringElement(cv::MORPH_RECT, {kHole, kHole}));
  cv::dilate(robot, mask, cv::getStructuringElement(cv::MORPH_RECT, {2 * ring + 1, 2 * ring + 1}));
  mask.setTo(kNear, mask);
  mask.setTo(kRobot, robot);
  return mask_;
}

SelfFilter::Shape SelfFilter::shape_of(const model::PlacedCapsule& capsule, const Pose& optical_from_world,
                                       const Sampling& sampling) {
  const Vector3 ends[2] = {optical_from_world * capsule.from, optical_from_world * capsule.to};
  const double radius_m = capsule.radius_m + kMargin_m;
  Shape shape{.from = ends[0].cast<float>(), .along = (ends[1] - ends[0]).cast<float>()};
  shape.inverse_squared_length = 1.0F / std::max(1e-9F, shape.along.squaredNorm());
  shape.squared_radius = static_cast<float>(radius_m * radius_m);
  if (std::max(ends[0].z(), ends[1].z()) + radius_m < kNearestSurface_m) return shape;

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
  const cv::Point first(cvFloor(std::clamp(left, -1e6, 1e6)), cvFloor(std::clamp(top, -1e6, 1e6)));
  const cv::Point last(cvCeil(std::clamp(right, -1e6, 1e6)), cvCeil(std::clamp(bottom, -1e6, 1e6)));
  shape.window = cv::Rect(first, last + cv::Point(1, 1)) & cv::Rect(0, 0, sampling.width, sampling.height);
  return shape;
}

// Marks the samples of a row that see the shape. Without branches and in plain floats: the compiler turns it into
// vector code.
void SelfFilter::paint_row(const Shape& s, const float* depth, int count, float first_x, float step_x, float y,
                           std::uint8_t* robot) {
  for (int i = 0; i < count; ++i) {
    const float x = first_x + static_cast<float>(i) * step_x;
    const float dx = x * depth[i] - s.from.x(), dy = y * depth[i] - s.from.y(), dz = depth[i] - s.from.z();
    const float share = (dx * s.along.x() + dy * s.along.y() + dz * s.along.z()) * s.inverse_squared_length;
    const float at = std::min(std::max(share, 0.0F), 1.0F);
    const float ox = dx - at * s.along.x(), oy = dy - at * s.along.y(), oz = dz - at * s.along.z();
    const bool inside = (ox * ox + oy * oy + oz * oz <= s.squared_radius) & (depth[i] > 0);
    robot[i] = static_cast<std::uint8_t>(robot[i] | (inside ? kRobot : 0));
  }
}

void SelfFilter::paint(const RgbdFrame& frame, const Sampling& sampling, int begin, int end) {
  std::vector<float> copy;
  const auto step_x = static_cast<float>(1 / sampling.fx);
  for (const Shape& shape : shapes_) {
    const cv::Rect& window = shape.window;
    const auto first_x = static_cast<float>((window.x - sampling.cx) / sampling.fx);
    for (int row = std::max(begin, window.y); row < std::min(end, window.br().y); ++row) {
      const float* const depth = sampling.row(frame, row, window.x, window.width, copy);
      const auto y = static_cast<float>((row - sampling.cy) / sampling.fy);
      paint_row(shape, depth, window.width, first_x, step_x, y, robot_.ptr<std::uint8_t>(row) + window.x);
    }
  }
}

}  // namespace pons::perception
