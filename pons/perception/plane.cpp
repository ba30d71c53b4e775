#include "pons/perception/plane.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace pons::perception {
namespace {

constexpr std::size_t kCells = 1500;  // looked at

}  // namespace

Plane fit_plane(const TopView& view, const std::vector<cv::Point>& cells) {
  Plane plane;
  const std::size_t stride = std::max<std::size_t>(1, cells.size() / kCells);
  for (std::size_t i = 0; i < cells.size(); i += stride) plane.middle += Eigen::Vector2d(cells[i].x, cells[i].y);
  plane.middle /= static_cast<double>((cells.size() + stride - 1) / stride);
  std::vector<double> residuals;
  double limit = 1e9;
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < cells.size(); i += stride) {
      const double z = TopView::metres(view.height(cells[i]));
      if (std::abs(z - plane.at(cells[i].x, cells[i].y)) > limit) continue;
      const Eigen::Vector3d row(1, cells[i].x - plane.middle.x(), cells[i].y - plane.middle.y());
      normal.noalias() += row * row.transpose();
      right += row * z;
    }
    plane.abc = normal.ldlt().solve(right);
    residuals.clear();
    for (std::size_t i = 0; i < cells.size(); i += stride) {
      residuals.push_back(std::abs(TopView::metres(view.height(cells[i])) - plane.at(cells[i].x, cells[i].y)));
    }
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::ranges::nth_element(residuals, middle);
    limit = std::max(0.004, 2.5 * *middle);
  }
  std::ranges::sort(residuals);
  const std::size_t kept = residuals.size() - residuals.size() / 33;
  double squares = 0;
  for (std::size_t i = 0; i < kept; ++i) squares += residuals[i] * residuals[i];
  plane.rms_m = std::sqrt(squares / static_cast<double>(kept));
  return plane;
}

}  // namespace pons::perception
