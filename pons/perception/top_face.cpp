#include "pons/perception/top_face.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "pons/perception/plane.hpp"

namespace pons::perception {
namespace {

constexpr double kOnPlane_m = 0.005;
constexpr double kLevel_m = 0.01, kBeside_m = 0.012;  // of what is seen to lie on another
constexpr double kUpright_rad = 3 * std::numbers::pi / 180;
constexpr double kLeaning_rad = 3.5 * std::numbers::pi / 180;
constexpr double kFullShape = 0.86;  // an ellipse fills π/4 of its rectangle
constexpr double kHidden = 0.04;
constexpr double kNarrowest_m = 0.03;
constexpr double kBelow = 0.06;
constexpr double kWhole = 0.90;
constexpr double kNearlyWhole = 0.95;
constexpr double kLostCorner = 0.10;  // of the outline
constexpr double kAcross = 0.5;       // of the width
// A soft edge lies a little lower than the top, and about as wide on every side.
constexpr double kRimDepth_m = 0.016, kRimLeast_m = 0.005, kRimMost_m = 0.014, kRimUneven_m = 0.005;

struct Rectangle {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();  // cells
  double yaw = 0;
  double length = 0, width = 0;  // cells
  std::vector<cv::Point> hull;
};

// Cells as a picture of their own, with a margin.
struct Mask {
  cv::Point corner;
  cv::Mat1b filled;
};

Mask mask_of(const std::vector<cv::Point>& cells) {
  const cv::Rect box = cv::boundingRect(cells);
  Mask mask{box.tl() - cv::Point(3, 3), cv::Mat1b(box.height + 6, box.width + 6, std::uint8_t{0})};
  for (const cv::Point& cell : cells) mask.filled(cell - mask.corner) = 1;
  return mask;
}

// Threads of cells along a neighbour's flank do not belong to the face.
std::vector<cv::Point> without_threads(const std::vector<cv::Point>& cells) {
  Mask mask = mask_of(cells);
  cv::morphologyEx(mask.filled, mask.filled, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  std::vector<cv::Point> kept;
  for (const cv::Point& cell : cells) {
    if (mask.filled(cell - mask.corner) != 0) kept.push_back(cell);
  }
  return 2 * kept.size() > cells.size() ? kept : cells;
}

std::vector<cv::Point> boundary(const std::vector<cv::Point>& cells) {
  const Mask mask = mask_of(cells);
  std::vector<cv::Point> rim;
  for (const cv::Point& cell : cells) {
    const cv::Point p = cell - mask.corner;
    const int around =
        mask.filled(p.y, p.x - 1) + mask.filled(p.y, p.x + 1) + mask.filled(p.y - 1, p.x) + mask.filled(p.y + 1, p.x);
    if (around < 4) rim.push_back(cell);
  }
  return rim;
}

// Turns the rectangle so that its sides run along the outline: least squares over the cells near each side, which share
// one angle. A smallest rectangle alone hangs on single cells.
double refined_yaw(const std::vector<cv::Point>& rim, const Rectangle& start) {
  double yaw = start.yaw;
  for (int round = 0; round < 3; ++round) {
    const double c = std::cos(yaw), s = std::sin(yaw), reach = round == 0 ? 4.0 : 2.5;
    struct Side {
      double n = 0, a = 0, b = 0, aa = 0, ab = 0;
    };
    std::array<Side, 4> sides;
    for (const cv::Point& cell : rim) {
      const double dx = cell.x - start.middle.x(), dy = cell.y - start.middle.y();
      const double along = c * dx + s * dy, across = -s * dx + c * dy;
      const double from_end = start.length / 2 - std::abs(along), from_side = start.width / 2 - std::abs(across);
      const bool on_long = std::abs(from_side) < reach && from_end > 4,
                 on_short = std::abs(from_end) < reach && from_side > 4;
      if (on_long == on_short) continue;
      Side& side = sides[on_long ? (across > 0 ? 0U : 1U) : (along > 0 ? 2U : 3U)];
      const double a = on_long ? along : across, b = on_long ? across : -along;
      side.n += 1, side.a += a, side.b += b, side.aa += a * a, side.ab += a * b;
    }
    double up = 0, down = 1e-9;
    for (const Side& side : sides) {
      if (side.n < 5) continue;
      up += side.ab - side.a * side.b / side.n;
      down += side.aa - side.a * side.a / side.n;
    }
    yaw += std::clamp(up / down, -0.1, 0.1);
  }
  return yaw;
}

enum class Outline : std::uint8_t {
  kRectangle,
  kRound,
  kBroken,  // a rectangle of which parts are missing: covered
};

struct Extent {
  double middle = 0, length = 0;
};

// Where a row of counts rises to, and falls from, half its plateau; between bins by interpolation.
Extent half_height(const std::vector<double>& counts, double first) {
  std::vector<double> sorted = counts;
  std::ranges::sort(sorted);
  const double half = 0.5 * sorted[sorted.size() * 6 / 10];
  std::size_t low = 0, high = counts.size() - 1;
  while (low < high && counts[low] < half) ++low;
  while (high > low && counts[high] < half) --high;
  const auto edge = [&](std::size_t inner, double outer_count) {
    const double rise = counts[inner] - outer_count;
    return rise > 1e-9 ? (counts[inner] - half) / rise : 0.5;
  };
  // Bin centres are first + i; a boxcar's half-height crossing lies half a bin beyond its last full centre.
  const double begin = static_cast<double>(low) - edge(low, low > 0 ? counts[low - 1] : 0);
  const double end = static_cast<double>(high) + edge(high, high + 1 < counts.size() ? counts[high + 1] : 0);
  return {first + 0.5 * (begin + end), end - begin};
}

Extent profile(const std::vector<cv::Point>& cells, const Eigen::Vector2d& axis, Outline outline) {
  double low = 1e9, high = -1e9;
  for (const cv::Point& cell : cells) {
    const double s = axis.x() * cell.x + axis.y() * cell.y;
    low = std::min(low, s), high = std::max(high, s);
  }
  std::vector<double> counts(static_cast<std::size_t>(high - low) + 3, 0.0);
  for (const cv::Point& cell : cells) {
    const double s = axis.x() * cell.x + axis.y() * cell.y - low + 0.5;
    const auto bin = static_cast<std::size_t>(s);
    // A cell is as wide as a bin: it belongs to two of them.
    const double share = s - static_cast<double>(bin);
    counts[bin] += 1 - share, counts[bin + 1] += share;
  }
  if (outline != Outline::kRectangle) return {0.5 * (low + high), high - low + 0.5};
  return half_height(counts, low - 0.5);
}

Rectangle fit_rectangle(const std::vector<cv::Point>& all_cells, Shape shape) {
  const std::vector<cv::Point> cells = without_threads(all_cells);
  const std::vector<cv::Point> rim = boundary(cells);
  std::vector<cv::Point> hull;
  cv::convexHull(rim, hull);
  const cv::RotatedRect box = cv::minAreaRect(hull);
  Rectangle rectangle;
  rectangle.middle = {static_cast<double>(box.center.x), static_cast<double>(box.center.y)};
  rectangle.yaw = static_cast<double>(box.angle) * std::numbers::pi / 180;
  rectangle.length = box.size.width, rectangle.width = box.size.height;
  if (rectangle.length < rectangle.width) {
    std::swap(rectangle.length, rectangle.width);
    rectangle.yaw += std::numbers::pi / 2;
  }
  const double fill = static_cast<double>(cells.size()) / ((rectangle.length + 1) * (rectangle.width + 1));
  Outline outline = Outline::kRectangle;
  if (fill < kFullShape) outline = shape == Shape::kBag ? Outline::kRound : Outline::kBroken;
  if (outline != Outline::kRound) {
    rectangle.yaw = refined_yaw(rim, rectangle);
  } else {
    const cv::Moments m = cv::moments(hull);
    rectangle.yaw = 0.5 * std::atan2(2 * m.mu11, m.mu20 - m.mu02);
  }
  const Eigen::Vector2d along(std::cos(rectangle.yaw), std::sin(rectangle.yaw)), across(-along.y(), along.x());
  const Extent length = profile(cells, along, outline), width = profile(cells, across, outline);
  rectangle.middle = along * length.middle + across * width.middle;
  rectangle.length = length.length, rectangle.width = width.length;
  if (rectangle.length < rectangle.width) {
    std::swap(rectangle.length, rectangle.width);
    rectangle.yaw += std::numbers::pi / 2;
  }
  rectangle.yaw = std::remainder(rectangle.yaw, std::numbers::pi);
  rectangle.hull = std::move(hull);
  return rectangle;
}

double height_near(const TopView& view, const std::vector<cv::Point>& cells, const Rectangle& at, double along,
                   double across) {
  const double c = std::cos(at.yaw), s = std::sin(at.yaw);
  std::vector<std::uint16_t> heights;
  for (const cv::Point& cell : cells) {
    const double dx = cell.x - at.middle.x(), dy = cell.y - at.middle.y();
    if (std::abs(c * dx + s * dy) <= along && std::abs(-s * dx + c * dy) <= across)
      heights.push_back(view.height(cell));
  }
  if (heights.empty()) return 0;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return TopView::metres(*middle);
}

// A tube keeps its height along its axis and loses it to both sides; a bag loses it all around.
bool is_tube(const TopView& view, const std::vector<cv::Point>& cells, const Rectangle& rectangle, double top_m) {
  if (rectangle.length < 1.2 * rectangle.width) return false;
  double ends = 0, flanks = 0;
  int count_ends = 0, count_flanks = 0;
  const double c = std::cos(rectangle.yaw), s = std::sin(rectangle.yaw);
  for (const cv::Point& cell : cells) {
    const double dx = cell.x - rectangle.middle.x(), dy = cell.y - rectangle.middle.y();
    const double along = std::abs(c * dx + s * dy) / (0.5 * rectangle.length);
    const double across = std::abs(-s * dx + c * dy) / (0.5 * rectangle.width);
    const double z = TopView::metres(view.height(cell));
    if (across < 0.15 && along > 0.6 && along < 0.9) ends += top_m - z, ++count_ends;
    if (along < 0.15 && across > 0.6 && across < 0.9) flanks += top_m - z, ++count_flanks;
  }
  if (count_ends == 0 || count_flanks == 0) return false;
  return ends / count_ends < 0.35 * flanks / count_flanks;
}

void place(const TopView& view, const Rectangle& rectangle, double height_m, const Plane& plane, Sighting& sighting) {
  const double x = view.x0_m + (rectangle.middle.x() + 0.5) * view.cell_m;
  const double y = view.y0_m + (rectangle.middle.y() + 0.5) * view.cell_m;
  for (const cv::Point& corner : rectangle.hull) sighting.hull_m.push_back(view.xy(corner));
  sighting.yaw_rad = rectangle.yaw;
  sighting.world_from_top = pose_xyz_yaw(x, y, view.surface_z_m + height_m, rectangle.yaw);
  sighting.size_m = {rectangle.length * view.cell_m, rectangle.width * view.cell_m, height_m};
  if (sighting.shape != Shape::kFlat) return;
  const Eigen::Vector2d slope = plane.abc.tail<2>() / view.cell_m;
  sighting.tilt_rad = std::atan(slope.norm());
  if (sighting.tilt_rad < kUpright_rad) return;
  const Vector3 normal = Vector3(-slope.x(), -slope.y(), 1).normalized();
  const Eigen::Vector2d along(std::cos(rectangle.yaw), std::sin(rectangle.yaw)), across(-along.y(), along.x());
  Vector3 x_axis(along.x(), along.y(), slope.dot(along));
  x_axis.normalize();
  sighting.world_from_top.linear().col(0) = x_axis;
  sighting.world_from_top.linear().col(1) = normal.cross(x_axis);
  sighting.world_from_top.linear().col(2) = normal;
  sighting.size_m.x() *= std::hypot(1.0, slope.dot(along));
  sighting.size_m.y() *= std::hypot(1.0, slope.dot(across));
}

// A pillow's top is flat, its edge is not: the parcel is as large as its edge. What stands out on one side only is a
// neighbour or a shadow's noise.
Rectangle with_rim(const TopView& view, const Region& region, const Plane& plane, const Rectangle& top) {
  std::vector<cv::Point> cells;
  for (const cv::Point& cell : region.cells) {
    const double above_m = TopView::metres(view.height(cell)) - plane.at(cell.x, cell.y);
    if (above_m < kOnPlane_m && above_m > -kRimDepth_m) cells.push_back(cell);
  }
  const Rectangle whole = fit_rectangle(cells, Shape::kFlat);
  const double turn = std::remainder(whole.yaw - top.yaw, 0.5 * std::numbers::pi);
  const bool swapped = std::abs(std::remainder(whole.yaw - top.yaw, std::numbers::pi)) > 0.25 * std::numbers::pi;
  const double length = swapped ? whole.width : whole.length, width = swapped ? whole.length : whole.width;
  const auto is_rim = [&](double wide, double narrow) {
    const double rim_m = 0.5 * (wide - narrow) * view.cell_m;
    return rim_m > kRimLeast_m && rim_m < kRimMost_m;
  };
  const bool around = is_rim(length, top.length) && is_rim(width, top.width) &&
                      (whole.middle - top.middle).norm() * view.cell_m < kRimUneven_m;
  return around && std::abs(turn) < 0.05 ? whole : top;
}

Sighting measure_flat(const TopView& view, const Region& region, const Plane& plane) {
  Sighting sighting;
  std::vector<cv::Point> top;
  for (const cv::Point& cell : region.cells) {
    if (std::abs(TopView::metres(view.height(cell)) - plane.at(cell.x, cell.y)) < kOnPlane_m) top.push_back(cell);
  }
  if (top.size() < 20) top = region.cells;
  Rectangle rectangle = fit_rectangle(top, Shape::kFlat);
  sighting.fill = static_cast<double>(top.size()) / std::max(1.0, rectangle.length * rectangle.width);
  rectangle = with_rim(view, region, plane, rectangle);
  place(view, rectangle, plane.at(rectangle.middle.x(), rectangle.middle.y()), plane, sighting);
  return sighting;
}

Sighting measure_curved(const TopView& view, const Region& region, const Plane& plane) {
  Sighting sighting;
  std::vector<std::uint16_t> heights;
  for (const cv::Point& cell : region.core) heights.push_back(view.height(cell));
  const auto nearly_top = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() * 97 / 100);
  std::nth_element(heights.begin(), nearly_top, heights.end());
  const double top_m = TopView::metres(*nearly_top);
  std::vector<cv::Point> body;
  for (const cv::Point& cell : region.cells) {
    if (TopView::metres(view.height(cell)) > 0.4 * top_m) body.push_back(cell);
  }
  Rectangle rectangle = fit_rectangle(body, Shape::kTube);
  sighting.shape = is_tube(view, body, rectangle, top_m) ? Shape::kTube : Shape::kBag;
  if (sighting.shape == Shape::kBag) rectangle = fit_rectangle(body, Shape::kBag);
  const double patch = 0.010 / view.cell_m;
  const double along = sighting.shape == Shape::kTube ? 0.4 * rectangle.length : patch;
  const double across = sighting.shape == Shape::kTube ? std::max(1.5, 0.08 * rectangle.width) : patch;
  sighting.fill = static_cast<double>(body.size()) / std::max(1.0, rectangle.length * rectangle.width);
  place(view, rectangle, height_near(view, body, rectangle, along, across), plane, sighting);
  return sighting;
}

}  // namespace

bool Sighting::covers(double x_m, double y_m, double margin_m) const {
  const Eigen::Vector2d offset(x_m - world_from_top.translation().x(), y_m - world_from_top.translation().y());
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return std::abs(c * offset.x() + s * offset.y()) <= 0.5 * size_m.x() + margin_m &&
         std::abs(-s * offset.x() + c * offset.y()) <= 0.5 * size_m.y() + margin_m;
}

bool Sighting::holds(const Sighting& part) const {
  const Vector3 middle = part.world_from_top.translation();
  if (std::abs(middle.z() - world_from_top.translation().z()) > kLevel_m) return false;
  return std::ranges::all_of(part.hull_m, [&](const Eigen::Vector2d& at) { return covers(at.x(), at.y(), kBeside_m); });
}

namespace {

Sighting measure_one(const TopView& view, const Region& region) {
  const bool has_core = region.core.size() >= kFewestCells;
  const Plane plane = region.plane ? *region.plane : fit_plane(view, has_core ? region.core : region.cells);
  const bool curved = plane.curved() && has_core;
  Sighting sighting = curved ? measure_curved(view, region, plane) : measure_flat(view, region, plane);
  sighting.label = region.label;
  sighting.flatness_m = plane.rms_m;
  sighting.crowded = region.crowded || region.below_share > 0 || sighting.tilt_rad > kLeaning_rad;
  sighting.near_robot = region.near_robot;
  sighting.at_screen = region.at_screen;
  // A box that only lost a corner to the border is measured as well as a whole one.
  // A narrow one is cut across by a short border.
  const double border_m = region.border_share * 2 * (sighting.size_m.x() + sighting.size_m.y());
  sighting.at_border = region.border_share > kLostCorner || border_m > kAcross * sighting.size_m.y() ||
                       (region.border_share > 0 && sighting.fill < kNearlyWhole);
  sighting.covered = sighting.shape == Shape::kFlat && region.below_share > kBelow && sighting.fill < kWhole;
  sighting.sliver = sighting.size_m.y() < kNarrowest_m;
  sighting.complete = !sighting.sliver && !region.near_robot && !region.at_screen && !sighting.at_border &&
                      region.hidden_share < kHidden;
  return sighting;
}

}  // namespace

std::vector<Sighting> measure(const TopView& view, const Segments& segments, const Both& both) {
  std::vector<Sighting> sightings(segments.regions.size());
  const auto some = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sightings[i] = measure_one(view, segments.regions[i]);
  };
  const std::size_t half = half_of(segments.regions);
  both([&] { some(0, half); }, [&] { some(half, sightings.size()); });
  // What leans on a lower neighbour hides a part of it, however whole the rest looks; of what is still coming into view
  // nobody knows whether it leans.
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    for (const int label : segments.regions[i].higher) {
      const Sighting& higher = sightings[static_cast<std::size_t>(label - 1)];
      const bool comes = higher.at_border && higher.world_from_top.translation().x() < view.camera_m.x();
      if (higher.tilt_rad > kLeaning_rad || comes) sightings[i].covered = true;
    }
  }
  return sightings;
}

}  // namespace pons::perception
