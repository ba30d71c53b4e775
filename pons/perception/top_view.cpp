#include "pons/perception/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace pons::perception {
namespace {

constexpr double kOverhang_m =
    0.06;                           // how far a parcel may stick out over the belt's sides and still be measured whole
constexpr double kTallest_m = 0.6;  // above the belt; what is higher does not lie on it
constexpr float kTooHigh_m = 0.8F;  // nothing that rides or is carried gets there
constexpr double kUnread =
    0.35;  // of a tile: far more than noise and edges cost, or the foot of an arm that hangs in view
constexpr double kFinestCell_m = 0.0025;
constexpr double kBare_m = 0.006;       // lower readings are of the belt
constexpr int kSameSurface = 80;        // 8 mm: readings of one cell that far below its highest are of what lies behind
constexpr std::size_t kSurrounded = 5;  // of 8 neighbours: along the edge of hidden belt there are 3
constexpr int kBorder = 2;              // samples
// What hangs before the camera hides that share of some tile, and whole squares with sides of so many samples; lost
// readings are single ones. What is read so few samples from it is beside it.
constexpr double kScreen = 0.05;
constexpr int kScreenLeast = 9, kBesideScreen = 6;

}  // namespace

TopViewer::TopViewer(const RgbdFrame& frame, const world::Belt& belt, Both both)
    : both_(std::move(both)), sampling_(frame.intrinsics), world_from_optical_(frame.world_from_optical) {
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
  const auto within = [](double value, int count) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(count)));
  };
  window_.x = within(left, sampling_.width);
  window_.y = within(top, sampling_.height);
  window_.width = within(right + 1, sampling_.width) - window_.x;
  window_.height = within(bottom + 1, sampling_.height) - window_.y;

  const Eigen::Matrix3d rotation = pose.linear();
  double x_min = 1e9, x_max = -1e9;
  for (int row = window_.y; row < window_.br().y; ++row) {
    for (int column = window_.x; column < window_.br().x; ++column) {
      const Vector3 ray =
          rotation * Vector3((column - sampling_.cx) / sampling_.fx, (row - sampling_.cy) / sampling_.fy, 1.0);
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
  highest_.create(rows, columns), filled_.create(rows, columns), view_.height.create(rows, columns);
  view_.colour.create(rows, columns), view_.flags.create(rows, columns);
  screen_.create(window_.size());
  const int middle = window_.y + window_.height / 2;
  strips_[0].begin = window_.y, strips_[0].end = strips_[1].begin = middle, strips_[1].end = window_.br().y;
  const auto width = static_cast<std::size_t>(window_.width);
  for (Strip& strip : strips_) {
    strip.cell_row.resize(width), strip.height_row.resize(width);
    strip.raised.resize(width * static_cast<std::size_t>(strip.end - strip.begin));
    strip.highest.create(rows, columns), strip.flags.create(rows, columns);
    strip.piles.resize(strip.highest.total());
  }
}

bool TopViewer::fits(const RgbdFrame& frame) const {
  const Sampling other(frame.intrinsics);
  return other.width == sampling_.width && other.height == sampling_.height && other.fx == sampling_.fx &&
         other.fy == sampling_.fy && other.cx == sampling_.cx && other.cy == sampling_.cy &&
         other.step == sampling_.step && frame.world_from_optical.isApprox(world_from_optical_, 1e-9);
}

// Of each sample in a row: its cell, −1 for none, and its height. A plain loop without branches: the compiler turns it
// into vector code.
void TopViewer::project(const RgbdFrame& frame, int row, Strip& strip) const {
  const Eigen::Matrix3f rotation = world_from_optical_.linear().cast<float>();
  const auto inverse_cell = static_cast<float>(1 / view_.cell_m);
  const auto from_x = static_cast<float>(view_.camera_m.x() - view_.x0_m) * inverse_cell;
  const auto from_y = static_cast<float>(view_.camera_m.y() - view_.y0_m) * inverse_cell;
  const auto from_z = static_cast<float>(view_.camera_m.z() - view_.surface_z_m);
  const auto first = static_cast<float>((window_.x - sampling_.cx) / sampling_.fx);
  const auto step = static_cast<float>(1 / sampling_.fx);
  // A ray through a sample is what all of the row share and a multiple of the optical x axis.
  const Eigen::Vector3f along = rotation.col(0);
  const Eigen::Vector3f shared =
      rotation.col(1) * static_cast<float>((row - sampling_.cy) / sampling_.fy) + rotation.col(2);
  const int columns = highest_.cols;
  const auto limit_x = static_cast<float>(columns), limit_y = static_cast<float>(highest_.rows);
  const float* const depth = sampling_.row(frame, row, window_.x, window_.width, strip.depth_row);
  int* const cell = strip.cell_row.data();
  int* const height = strip.height_row.data();
  const int count = window_.width;
  for (int i = 0; i < count; ++i) {
    const float u = first + static_cast<float>(i) * step;
    const float x = from_x + depth[i] * (shared.x() + u * along.x()) * inverse_cell;
    const float y = from_y + depth[i] * (shared.y() + u * along.y()) * inverse_cell;
    const float z = from_z + depth[i] * (shared.z() + u * along.z());
    const bool outside =
        (depth[i] <= 0) | (x < 0) | (y < 0) | (x >= limit_x) | (y >= limit_y) | (z <= -0.4F) | (z >= kTooHigh_m);
    const int column_of = static_cast<int>(std::min(std::max(x, 0.0F), limit_x));
    const int row_of = static_cast<int>(std::min(std::max(y, 0.0F), limit_y));
    cell[i] = outside ? -1 : row_of * columns + column_of;
    const float rounded = static_cast<float>(TopView::kLevel) + std::min(std::max(z, -0.4F), 3.0F) * 1e4F + 0.5F;
    height[i] = static_cast<int>(rounded);  // never negative; lround would leave the vector
  }
}

// `seen` is the row of the robot's mask, `from` and `to` the columns that hold any of it.
void TopViewer::drop_robot(const std::uint8_t* seen, int from, int to, Strip& strip) const {
  auto* const flags = strip.flags.ptr<std::uint8_t>();
  for (int column = from; column < to; ++column) {
    int& cell = strip.cell_row[static_cast<std::size_t>(column - window_.x)];
    if (seen[column] == 0) continue;
    if (seen[column] != SelfFilter::kRobot && cell >= 0) {
      flags[cell] |= TopView::kNearRobot;
      continue;
    }
    cell = -1;
    // That the robot hides what is below is no fault of the camera's.
    strip.height_row[static_cast<std::size_t>(column - window_.x)] = TopView::kLevel;
  }
}

// No reading has the camera's own height.
void TopViewer::count_readings(int row, Strip& strip) {
  const int tile = std::max(1, window_.width / static_cast<int>(kTiles));
  constexpr int kTooHigh = TopView::kLevel + static_cast<int>(kTooHigh_m * 1e4F);
  const int* const height = strip.height_row.data();
  auto* const hidden = screen_.ptr<std::uint8_t>(row - window_.y);
  for (int i = 0; i < window_.width; ++i) hidden[i] = height[i] >= kTooHigh ? 1 : 0;
  for (std::size_t t = 0; t < kTiles; ++t) {
    const int from = static_cast<int>(t) * tile, to = std::min(from + tile, window_.width);
    int unread = 0;
    for (int i = from; i < to; ++i) unread += hidden[i];
    strip.unread[t] += unread;
    strip.read[t] += std::max(0, to - from) - unread;
  }
}

// The highest reading of each cell. Those above bare belt are kept: they are few, and of the others only the height
// matters. The robot is within `near`.
void TopViewer::find_highest(const RgbdFrame& frame, const cv::Mat1b& robot, cv::Rect near, Strip& strip) {
  strip.highest.setTo(0), strip.flags.setTo(0);
  strip.read.fill(0), strip.unread.fill(0);
  auto* const highest = strip.highest.ptr<std::uint16_t>();
  const std::uint16_t bare = TopView::steps(kBare_m);
  std::size_t count = 0;
  for (int row = strip.begin; row < strip.end; ++row) {
    project(frame, row, strip);
    if (row >= near.y && row < near.br().y) drop_robot(robot.ptr<std::uint8_t>(row), near.x, near.br().x, strip);
    count_readings(row, strip);
    for (int i = 0; i < window_.width; ++i) {
      const int cell = strip.cell_row[static_cast<std::size_t>(i)];
      if (cell < 0) continue;
      const auto height = static_cast<std::uint16_t>(strip.height_row[static_cast<std::size_t>(i)]);
      highest[cell] = std::max(highest[cell], height);
      strip.raised[count] = {cell, static_cast<std::int16_t>(window_.x + i), static_cast<std::int16_t>(row), height};
      count += height >= bare ? 1U : 0U;
    }
  }
  strip.raised_count = count;
}

// What hangs before the camera hides whole patches of the picture. Beside these, an outline may be theirs.
void TopViewer::find_screen() {
  const auto square = [](int side) { return cv::getStructuringElement(cv::MORPH_RECT, {side, side}); };
  cv::morphologyEx(screen_, screen_, cv::MORPH_OPEN, square(kScreenLeast));
  cv::dilate(screen_, screen_, square(2 * kBesideScreen + 1));
}

// What was read of the highest surface of each cell.
void TopViewer::accumulate(const RgbdFrame& frame, Strip& strip) const {
  std::ranges::fill(strip.piles, Pile{});
  const auto* const highest = highest_.ptr<std::uint16_t>();
  const auto stride = static_cast<std::size_t>(frame.intrinsics.width);
  const cv::Rect inner(kBorder, kBorder, sampling_.width - 2 * kBorder, sampling_.height - 2 * kBorder);
  for (std::size_t i = 0; i < strip.raised_count; ++i) {
    const Reading& reading = strip.raised[i];
    if (reading.height + kSameSurface < highest[reading.cell]) continue;
    Pile& pile = strip.piles[static_cast<std::size_t>(reading.cell)];
    pile.sum += reading.height;
    ++pile.count;
    const std::size_t pixel = 3 * (static_cast<std::size_t>(reading.row * sampling_.step) * stride +
                                   static_cast<std::size_t>(reading.column * sampling_.step));
    pile.colour = {frame.rgb[pixel], frame.rgb[pixel + 1], frame.rgb[pixel + 2]};
    if (!inner.contains({reading.column, reading.row})) pile.flags |= TopView::kAtBorder;
    if (has_screen_ && screen_(reading.row - window_.y, reading.column - window_.x) != 0)
      pile.flags |= TopView::kAtScreen;
  }
}

// The highest surface of each cell, averaged over its readings; and what was seen of it.
void TopViewer::merge(int begin, int end) {
  const auto& [first, second] = strips_;
  auto* const highest = highest_.ptr<std::uint16_t>();
  auto* const colour = view_.colour.ptr<cv::Vec3b>();
  auto* const flags = view_.flags.ptr<std::uint8_t>();
  const auto *const first_flags = first.flags.ptr<std::uint8_t>(), *const second_flags =
                                                                       second.flags.ptr<std::uint8_t>();
  for (int cell = begin * highest_.cols; cell < end * highest_.cols; ++cell) {
    const Pile &one = first.piles[static_cast<std::size_t>(cell)],
               &other = second.piles[static_cast<std::size_t>(cell)];
    const int count = one.count + other.count;
    if (count > 1) highest[cell] = static_cast<std::uint16_t>((one.sum + other.sum) / count);
    colour[cell] = other.count > 0 ? other.colour : one.colour;
    flags[cell] = static_cast<std::uint8_t>(one.flags | other.flags | first_flags[cell] | second_flags[cell]);
  }
}

// Lost readings leave single empty cells; hidden belt leaves wide ones, which must stay unknown.
void TopViewer::fill_pinholes(int begin, int end) {
  highest_.rowRange(begin, end).copyTo(filled_.rowRange(begin, end));
  const auto* const raw = highest_.ptr<std::uint16_t>();
  auto* const filled = filled_.ptr<std::uint16_t>();
  auto* const colour = view_.colour.ptr<cv::Vec3b>();
  const int stride = highest_.cols;
  for (int row = std::max(1, begin); row < std::min(highest_.rows - 1, end); ++row) {
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

void TopViewer::smooth(int begin, int end) {
  constexpr int kSize = 5, kReach = kSize / 2;
  const int from = std::max(0, begin - kReach), to = std::min(filled_.rows, end + kReach);
  cv::Mat1w smoothed;
  cv::medianBlur(filled_.rowRange(from, to), smoothed, kSize);
  smoothed.rowRange(begin - from, end - from).copyTo(view_.height.rowRange(begin, end));
}

template <typename Work>
void TopViewer::halves(const Work& work) {
  const int middle = highest_.rows / 2;
  both_([&] { work(0, middle); }, [&] { work(middle, highest_.rows); });
}

const TopView& TopViewer::build(const RgbdFrame& frame, const cv::Mat1b& robot) {
  const cv::Rect near = cv::boundingRect(robot) & window_;
  auto& [first, second] = strips_;
  both_([&] { find_highest(frame, robot, near, first); }, [&] { find_highest(frame, robot, near, second); });
  double hidden = 0;  // share of the tile of which that is most
  for (const Strip& strip : strips_) {
    for (std::size_t t = 0; t < kTiles; ++t)
      hidden = std::max(hidden, static_cast<double>(strip.unread[t]) / std::max(1, strip.read[t] + strip.unread[t]));
  }
  view_.clear = hidden <= kUnread;
  has_screen_ = hidden > kScreen;
  if (has_screen_) find_screen();
  const cv::_InputArray one(first.highest);  // else std::max is meant
  cv::max(one, second.highest, highest_);
  both_([&] { accumulate(frame, first); }, [&] { accumulate(frame, second); });
  halves([&](int begin, int end) { merge(begin, end); });
  halves([&](int begin, int end) { fill_pinholes(begin, end); });
  halves([&](int begin, int end) { smooth(begin, end); });
  return view_;
}

}  // namespace pons::perception
