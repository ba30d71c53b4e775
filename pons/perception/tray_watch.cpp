#include "pons/perception/tray_watch.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace pons::perception {
namespace {

constexpr float kStands_m = 0.015F;
constexpr double kSmallest_m2 = 0.0015;
constexpr double kAbove_m = 0.6;  // above the place's box a falling thing still counts as in it

}  // namespace

void TrayWatch::process(const RgbdFrame& frame, const Sampling& sampling, const cv::Mat1b& robot) {
  depth_m_.create(sampling.height, sampling.width);
  for (int row = 0; row < sampling.height; ++row) {
    for (int column = 0; column < sampling.width; ++column) {
      const bool hidden = robot(row, column) != 0;
      depth_m_(row, column) = hidden ? 0 : sampling.depth(frame, row, column);
    }
  }
  cv::medianBlur(depth_m_, depth_m_, 3);
  if (frames_ < kLearn) {
    if (frames_++ == 0) empty_m_ = cv::Mat1f::zeros(depth_m_.size());
    empty_m_ = cv::max(empty_m_, depth_m_);
    return;
  }

  things_.create(depth_m_.size());
  const Eigen::Matrix3d rotation = frame.world_from_optical.linear();
  const Vector3 from = frame.world_from_optical.translation();
  const Vector3 half = 0.5 * place_.size_m;
  double pixels_per_m2 = 0;
  for (int row = 0; row < sampling.height; ++row) {
    for (int column = 0; column < sampling.width; ++column) {
      things_(row, column) = 0;
      const float depth = depth_m_(row, column), empty = empty_m_(row, column);
      if (depth <= 0 || empty <= 0 || depth > empty - std::max(kStands_m, 0.01F * empty)) continue;
      const Vector3 ray((column - sampling.cx) / sampling.fx, (row - sampling.cy) / sampling.fy, 1);
      const Vector3 offset = from + rotation * ray * static_cast<double>(depth) - place_.center_m;
      if (std::abs(offset.x()) > half.x() || std::abs(offset.y()) > half.y()) continue;
      if (offset.z() < -half.z() - 0.05 || offset.z() > half.z() + kAbove_m) continue;
      things_(row, column) = 255;
      pixels_per_m2 = sampling.fx * sampling.fy / static_cast<double>(depth * depth);
    }
  }
  cv::morphologyEx(things_, things_, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {3, 3}));
  cv::Mat1i components, stats;
  cv::Mat1d centres;
  const int count = cv::connectedComponentsWithStats(things_, components, stats, centres, 8, CV_32S);
  occupancy_ = 0;
  for (int i = 1; i < count; ++i) {
    if (stats(i, cv::CC_STAT_AREA) >= std::max(8.0, 0.5 * kSmallest_m2 * pixels_per_m2)) ++occupancy_;
  }
}

}  // namespace pons::perception
