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
  const std::size_t count = (cells.size() + stride - 1) / stride;
  plane.middle /= static_cast<double>(count);
  struct Sample {
    double x = 0, y = 0, z = 0, residual = 0;
  };
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < cells.size(); i += stride) {
    samples.push_back(
        {cells[i].x - plane.middle.x(), cells[i].y - plane.middle.y(), TopView::metres(view.height(cells[i]))});
  }
  std::vector<double> residuals(samples.size());
  double limit = 1e9;
  for (int round = 0; round < 4; ++round) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Sample& sample : samples) {
      if (sample.residual > limit) continue;
      const Eigen::Vector3d row(1, sample.x, sample.y);
      normal.noalias() += row * row.transpose();
      right += row * sample.z;
    }
    plane.abc = normal.ldlt().solve(right);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      Sample& sample = samples[i];
      sample.residual = std::abs(sample.z - (plane.abc[0] + plane.abc[1] * sample.x + plane.abc[2] * sample.y));
      residuals[i] = sample.residual;
    }
    const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
    std::ranges::nth_element(residuals, middle);
    limit = std::max(0.004, 2.5 * *middle);
  }
  const std::size_t kept = residuals.size() - residuals.size() / 33;
  std::ranges::nth_element(residuals, residuals.begin() + static_cast<std::ptrdiff_t>(kept - 1));
  double squares = 0;
  for (std::size_t i = 0; i < kept; ++i) squares += residuals[i] * residuals[i];
  plane.rms_m = std::sqrt(squares / static_cast<double>(kept));
  return plane;
}

}  // namespace pons::perception
