#include "pons/perception/tray_watch.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace pons::perception {
namespace {

constexpr float kStands_m = 0.015F;
constexpr double kSmallest_m2 = 0.0015;
constexpr double kAbove_m = 0.6;   // above the place's box a falling thing still counts as in it
constexpr double kSlack_m = 0.03;  // what noise and a sagging parcel may reach beyond a box, or below belt and rims
constexpr double kBelow_m = 0.05;

}  // namespace

TrayWatch::Box TrayWatch::box_of(const world::Place& place) {
  const bool mouth = place.kind == world::PlaceKind::kChute || place.kind == world::PlaceKind::kException;
  Box box{place.center_m - 0.5 * place.size_m, place.center_m + 0.5 * place.size_m};
  if (mouth) {
    box.low.z() = place.center_m.z() - place.size_m.z();
    box.high.z() = place.center_m.z();
  }
  return box;
}

TrayWatch::TrayWatch(const world::World& world, const world::Place& place) : watched_(box_of(place)) {
  double lowest_way = world.belt.surface_z_m;
  for (const world::Place& other : world.places) {
    if (other.name == place.name) continue;
    if (other.kind != world::PlaceKind::kChute && other.kind != world::PlaceKind::kException) continue;
    chutes_.push_back(box_of(other));
    lowest_way = std::min(lowest_way, chutes_.back().high.z());
  }
  const double top = watched_.high.z();
  watched_.high.z() = std::max(top + kSlack_m, std::min(top + kAbove_m, lowest_way - kSlack_m));
  watched_.low.z() -= kBelow_m;
}

bool TrayWatch::counts(const Vector3& at) const {
  if (!watched_.contains(at)) return false;
  return std::none_of(chutes_.begin(), chutes_.end(), [&](const Box& chute) { return chute.contains(at); });
}

// The median of a later frame may be any reading of its neighbourhood, all the more where many are missing. Seen at a
// flat angle the next row lies centimetres nearer: so a thing must be nearer than all of the neighbourhood was.
void TrayWatch::learn() {
  if (frames_++ == 0) empty_m_ = cv::Mat1f::zeros(depth_m_.size());
  empty_m_ = cv::max(empty_m_, depth_m_);
  if (frames_ < kLearn) return;
  const cv::Mat1f seen_m = empty_m_.clone();
  for (int row = 0; row < seen_m.rows; ++row) {
    for (int column = 0; column < seen_m.cols; ++column) {
      float& nearest = empty_m_(row, column);
      for (int y = std::max(0, row - 1); y <= std::min(seen_m.rows - 1, row + 1); ++y) {
        for (int x = std::max(0, column - 1); x <= std::min(seen_m.cols - 1, column + 1); ++x) {
          const float depth = seen_m(y, x);
          if (depth > 0 && (nearest <= 0 || depth < nearest)) nearest = depth;
        }
      }
    }
  }
}

void TrayWatch::process(const RgbdFrame& frame, const Sampling& sampling, const cv::Mat1b& robot) {
  depth_m_.create(sampling.height, sampling.width);
  for (int row = 0; row < sampling.height; ++row) {
    for (int column = 0; column < sampling.width; ++column) {
      const bool hidden = robot(row, column) != 0;
      depth_m_(row, column) = hidden ? 0 : sampling.depth(frame, row, column);
    }
  }
  if (frames_ < kLearn) {
    learn();
    return;
  }
  cv::medianBlur(depth_m_, depth_m_, 3);

  things_.create(depth_m_.size());
  const Eigen::Matrix3d rotation = frame.world_from_optical.linear();
  const Vector3 from = frame.world_from_optical.translation();
  double pixels_per_m2 = 0;
  for (int row = 0; row < sampling.height; ++row) {
    for (int column = 0; column < sampling.width; ++column) {
      things_(row, column) = 0;
      const float depth = depth_m_(row, column), empty = empty_m_(row, column);
      if (depth <= 0 || empty <= 0 || depth > empty - std::max(kStands_m, 0.01F * empty)) continue;
      const Vector3 ray((column - sampling.cx) / sampling.fx, (row - sampling.cy) / sampling.fy, 1);
      if (!counts(from + rotation * ray * static_cast<double>(depth))) continue;
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
