#include "pons/perception/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace pons::perception {
namespace {

constexpr double kOverhang_m =
    0.06;                           // how far a parcel may stick out over the belt's sides and still be measured whole
constexpr double kTallest_m = 0.6;  // above the belt; what is higher does not lie on it
constexpr double kFinestCell_m = 0.0025;
constexpr double kBare_m = 0.006;       // lower readings are of the belt
constexpr int kSameSurface = 80;        // 8 mm: readings of one cell that far below its highest are of what lies behind
constexpr std::size_t kSurrounded = 5;  // of 8 neighbours: along the edge of hidden belt there are 3
constexpr int kBorder = 2;              // samples

}  // namespace

TopViewer::TopViewer(const RgbdFrame& frame, const world::Belt& belt)
    : sampling_(frame.intrinsics), world_from_optical_(frame.world_from_optical) {
  const Pose& pose = frame.world_from_optical;
  const Pose optical_from_world = pose.inverse();
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const double x : {belt.x_start_m, belt.x_end_m}) {
    for (const double side : {-0.5, 0.5}) {
      for (const double z : {0.0, kTallest_m}) {
        const double y = belt.y_center_m + side * (belt.width_m + 2 * kOverhang_m);
        const Vector3 point = optical_from_world * Vector3(x, y, belt.surface_z_m + z);
        const double depth = std::max(0.05, point.z());
        const double u = sampling_.cx + sampling_.fx * point.x() / depth,
                     v = sampling_.cy + sampling_.fy * point.y() / depth;
        left = std::min(left, u), right = std::max(right, u), top = std::min(top, v), bottom = std::max(bottom, v);
      }
    }
  }
  const auto within = [](double value, int count) { return static_cast<int>(std::clamp(value, 0.0, double(count))); };
  window_.x = within(left, sampling_.width);
  window_.y = within(top, sampling_.height);
  window_.width = within(right + 1, sampling_.width) - window_.x;
  window_.height = within(bottom + 1, sampling_.height) - window_.y;

  const Eigen::Matrix3d rotation = pose.linear();
  for (auto* part : {&ray_x_, &ray_y_, &ray_z_}) part->reserve(static_cast<std::size_t>(window_.area()));
  double x_min = 1e9, x_max = -1e9;
  for (int row = window_.y; row < window_.br().y; ++row) {
    for (int column = window_.x; column < window_.br().x; ++column) {
      const Vector3 ray =
          rotation * Vector3((column - sampling_.cx) / sampling_.fx, (row - sampling_.cy) / sampling_.fy, 1.0);
      ray_x_.push_back(static_cast<float>(ray.x()));
      ray_y_.push_back(static_cast<float>(ray.y()));
      ray_z_.push_back(static_cast<float>(ray.z()));
      if (ray.z() > -0.05) continue;  // at or above the horizon
      const double x = pose.translation().x() + ray.x() * (belt.surface_z_m - pose.translation().z()) / ray.z();
      x_min = std::min(x_min, x), x_max = std::max(x_max, x);
    }
  }
  const double distance_m = std::abs(pose.translation().z() - belt.surface_z_m);
  view_.cell_m = std::max(kFinestCell_m, 1.25 * distance_m / std::min(sampling_.fx, sampling_.fy));
  view_.x0_m = std::max(belt.x_start_m, x_min);
  view_.y0_m = belt.y_center_m - 0.5 * belt.width_m - kOverhang_m;
  view_.surface_z_m = belt.surface_z_m;
  view_.camera_m = pose.translation();
  const int columns = std::max(8, static_cast<int>((std::min(belt.x_end_m, x_max) - view_.x0_m) / view_.cell_m));
  const int rows = std::max(8, static_cast<int>((belt.width_m + 2 * kOverhang_m) / view_.cell_m));
  highest_.create(rows, columns);
  sum_.create(rows, columns), count_.create(rows, columns);
  view_.colour.create(rows, columns), view_.flags.create(rows, columns);
  cell_of_.resize(ray_x_.size()), height_of_.resize(ray_x_.size());
}

bool TopViewer::fits(const RgbdFrame& frame) const {
  const Sampling other(frame.intrinsics);
  return other.width == sampling_.width && other.height == sampling_.height && other.fx == sampling_.fx &&
         other.fy == sampling_.fy && other.cx == sampling_.cx && other.cy == sampling_.cy &&
         other.step == sampling_.step && frame.world_from_optical.isApprox(world_from_optical_, 1e-9);
}

// Plain loops over rows of floats without branches: the compiler turns them into vector code.
void TopViewer::project(const RgbdFrame& frame) {
  const auto inverse_cell = static_cast<float>(1 / view_.cell_m);
  const auto from_x = static_cast<float>(view_.camera_m.x() - view_.x0_m) * inverse_cell;
  const auto from_y = static_cast<float>(view_.camera_m.y() - view_.y0_m) * inverse_cell;
  const auto from_z = static_cast<float>(view_.camera_m.z() - view_.surface_z_m);
  const int columns = highest_.cols;
  const auto limit_x = static_cast<float>(columns), limit_y = static_cast<float>(highest_.rows);
  for (int row = 0; row < window_.height; ++row) {
    const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(window_.width);
    const float* const depth = sampling_.row(frame, window_.y + row, window_.x, window_.width, depth_row_);
    const float* const ray_x = ray_x_.data() + first;
    const float* const ray_y = ray_y_.data() + first;
    const float* const ray_z = ray_z_.data() + first;
    int* const cell = cell_of_.data() + first;
    std::uint16_t* const height = height_of_.data() + first;
    for (int i = 0; i < window_.width; ++i) {
      const float x = from_x + depth[i] * ray_x[i] * inverse_cell, y = from_y + depth[i] * ray_y[i] * inverse_cell;
      const float z = from_z + depth[i] * ray_z[i];
      const bool inside =
          (depth[i] > 0) & (x >= 0) & (y >= 0) & (x < limit_x) & (y < limit_y) & (z > -0.4F) & (z < 3.0F);
      const int column_of = static_cast<int>(std::min(std::max(x, 0.0F), limit_x));
      const int row_of = static_cast<int>(std::min(std::max(y, 0.0F), limit_y));
      const float steps = static_cast<float>(TopView::kLevel) + std::min(std::max(z, -0.4F), 3.0F) * 1e4F + 0.5F;
      cell[i] = inside ? row_of * columns + column_of : -1;
      height[i] = static_cast<std::uint16_t>(static_cast<int>(steps));
    }
  }
}

void TopViewer::drop_robot(const cv::Mat1b& robot) {
  view_.flags.setTo(0);
  auto* const flags = view_.flags.ptr<std::uint8_t>();
  const cv::Rect near = cv::boundingRect(robot) & window_;
  for (int row = near.y; row < near.br().y; ++row) {
    const std::uint8_t* const seen = robot.ptr<std::uint8_t>(row);
    int* const cell = cell_of_.data() + static_cast<std::ptrdiff_t>(row - window_.y) * window_.width - window_.x;
    for (int column = near.x; column < near.br().x; ++column) {
      if (seen[column] == 0 || cell[column] < 0) continue;
      if (seen[column] == SelfFilter::kRobot) {
        cell[column] = -1;
      } else {
        flags[cell[column]] |= TopView::kNearRobot;
      }
    }
  }
}

// The highest reading of each cell. Those above bare belt are noted: they are few, and of the others only the height
// matters.
void TopViewer::find_highest() {
  highest_.setTo(0);
  auto* const highest = highest_.ptr<std::uint16_t>();
  const std::uint16_t bare = TopView::steps(kBare_m);
  raised_.resize(cell_of_.size());
  raised_end_.resize(static_cast<std::size_t>(window_.height));
  std::size_t count = 0;
  for (std::size_t row = 0; row < raised_end_.size(); ++row) {
    const std::size_t first = row * static_cast<std::size_t>(window_.width);
    const int* const cells = cell_of_.data() + first;
    const std::uint16_t* const heights = height_of_.data() + first;
    for (int i = 0; i < window_.width; ++i) {
      const int cell = cells[i];
      if (cell < 0) continue;
      highest[cell] = std::max(highest[cell], heights[i]);
      raised_[count] = i;
      count += heights[i] >= bare ? 1U : 0U;
    }
    raised_end_[row] = count;
  }
}

// The highest surface of each cell, averaged over its readings; and what was seen of it.
void TopViewer::accumulate(const RgbdFrame& frame) {
  sum_.setTo(0), count_.setTo(0), view_.colour.setTo(cv::Scalar::all(0));
  auto* const highest = highest_.ptr<std::uint16_t>();
  auto* const sum = sum_.ptr<int>();
  auto* const count = count_.ptr<int>();
  auto* const colour = view_.colour.ptr<cv::Vec3b>();
  auto* const flags = view_.flags.ptr<std::uint8_t>();
  const auto stride = static_cast<std::size_t>(frame.intrinsics.width);
  std::size_t next = 0;
  for (int row = window_.y; row < window_.br().y; ++row) {
    const bool border_row = row < kBorder || row >= sampling_.height - kBorder;
    const auto line = static_cast<std::size_t>(row - window_.y);
    const std::size_t first = line * static_cast<std::size_t>(window_.width);
    for (; next < raised_end_[line]; ++next) {
      const auto i = first + static_cast<std::size_t>(raised_[next]);
      const int cell = cell_of_[i];
      if (height_of_[i] + kSameSurface < highest[cell]) continue;
      sum[cell] += height_of_[i];
      ++count[cell];
      const int column = window_.x + raised_[next];
      const std::size_t pixel = 3 * (static_cast<std::size_t>(row * sampling_.step) * stride +
                                     static_cast<std::size_t>(column * sampling_.step));
      colour[cell] = {frame.rgb[pixel], frame.rgb[pixel + 1], frame.rgb[pixel + 2]};
      if (border_row || column < kBorder || column >= sampling_.width - kBorder) flags[cell] |= TopView::kAtBorder;
    }
  }
  const int total = highest_.rows * highest_.cols;
  for (int cell = 0; cell < total; ++cell) {
    if (count[cell] > 1) highest[cell] = static_cast<std::uint16_t>(sum[cell] / count[cell]);
  }
}

// Lost readings leave single empty cells; hidden belt leaves wide ones, which must stay unknown.
void TopViewer::fill_pinholes() {
  highest_.copyTo(filled_);
  const auto* const raw = highest_.ptr<std::uint16_t>();
  auto* const filled = filled_.ptr<std::uint16_t>();
  auto* const colour = view_.colour.ptr<cv::Vec3b>();
  const int stride = highest_.cols;
  for (int row = 1; row + 1 < highest_.rows; ++row) {
    for (int column = 1; column + 1 < stride; ++column) {
      const int i = row * stride + column;
      if (raw[i] > 0 || raw[i - 1] + raw[i + 1] == 0) continue;
      std::array<int, 8> around{};
      std::size_t known = 0;
      for (const int j :
           {i - stride - 1, i - stride, i - stride + 1, i - 1, i + 1, i + stride - 1, i + stride, i + stride + 1}) {
        if (raw[j] == 0) continue;
        std::size_t place = known++;
        for (; place > 0 && raw[around[place - 1]] > raw[j]; --place) around[place] = around[place - 1];
        around[place] = j;
      }
      if (known < kSurrounded) continue;
      filled[i] = raw[around[known / 2]];
      colour[i] = colour[around[known / 2]];
    }
  }
}

const TopView& TopViewer::build(const RgbdFrame& frame, const cv::Mat1b& robot) {
  project(frame);
  drop_robot(robot);
  find_highest();
  accumulate(frame);
  fill_pinholes();
  cv::medianBlur(filled_, view_.height, 5);
  return view_;
}

}  // namespace pons::perception
