// The plane that fits the top of an object.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "pons/perception/top_view.hpp"

namespace pons::perception {

// Height above the belt (m) = abc[0] + abc[1] · (x − middle.x) + abc[2] · (y − middle.y); x and y in cells.
struct Plane {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  Eigen::Vector3d abc = Eigen::Vector3d::Zero();
  double rms_m = 0;  // of the cells it was fitted to, worst 3 % left out

  [[nodiscard]] double at(double x, double y) const {
    return abc[0] + abc[1] * (x - middle.x()) + abc[2] * (y - middle.y());
  }
  // Filtered noise of a plane stays below half of this limit.
  [[nodiscard]] bool curved() const { return rms_m > 0.0022; }
};

// Least squares with outliers (side faces, a neighbour's rim) left out in turn. `cells` must not be empty.
[[nodiscard]] Plane fit_plane(const TopView& view, const std::vector<cv::Point>& cells);

}  // namespace pons::perception
