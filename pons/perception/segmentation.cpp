#include "pons/perception/segmentation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace pons::perception {
namespace {

constexpr double kAboveBelt_m = 0.008;  // thinner things are not objects
constexpr double kSmallest_m2 = 0.0012;
constexpr int kStep = 65;      // 6.5 mm between neighbours over three cells is an edge between two surfaces
constexpr int kGrowStep = 80;  // a cell joins a neighbour's object across at most 8 mm
constexpr int kLook = 3;       // cells to look beyond an outline
constexpr int kCrowdedLook = 4;
constexpr int kHigher = 60;  // 6 mm
constexpr int kMostCuts = 24;
constexpr double kNarrowestPiece_m = 0.05;  // what an outline alone shows to be narrower is a ragged edge
constexpr double kEdgeCells = 0.5;
constexpr double kStillThere = 0.85;    // of what was seen, and no more beside what is cut off
constexpr double kHalfLabel_m = 0.025;  // a label's middle is at least so far from its object's edge
const std::array<cv::Point, 4> kAround = {cv::Point{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
const std::array<cv::Point, 8> kAround8 = {cv::Point{1, 0}, {1, 1},   {0, 1},  {-1, 1},
                                           {-1, 0},         {-1, -1}, {0, -1}, {1, -1}};

int typical_height(const TopView& view, const std::vector<cv::Point>& cells) {
  std::vector<std::uint16_t> heights;
  const std::size_t stride = std::max<std::size_t>(1, cells.size() / 500);
  for (std::size_t i = 0; i < cells.size(); i += stride) heights.push_back(view.height(cells[i]));
  if (heights.empty()) return 0;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

}  // namespace

std::size_t half_of(const std::vector<Region>& regions) {
  std::size_t all = 0, taken = 0, count = 0;
  for (const Region& region : regions) all += region.cells.size();
  while (count < regions.size() && 2 * taken < all) taken += regions[count++].cells.size();
  return count;
}

void Segmenter::find_cores(const TopView& view) {
  const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_RECT, {3, 3});
  cv::dilate(view.height, high_, kernel);
  cv::erode(view.height, low_, kernel);
  foreground_.create(view.height.size());
  flat_.create(view.height.size());
  const std::uint16_t least = TopView::steps(kAboveBelt_m);
  const auto* const height = view.height.ptr<std::uint16_t>();
  const auto* const high = high_.ptr<std::uint16_t>();
  const auto* const low = low_.ptr<std::uint16_t>();
  auto* const foreground = foreground_.ptr<std::uint8_t>();
  auto* const flat = flat_.ptr<std::uint8_t>();
  const int total = view.height.rows * view.height.cols;
  // Coarser cells see the same slope as a larger step.
  const int step = static_cast<int>(kStep * std::max(1.0, view.cell_m / 0.0025));
  for (int i = 0; i < total; ++i) {
    foreground[i] = height[i] >= least ? 255 : 0;
    flat[i] = height[i] >= least && high[i] - low[i] < step ? 255 : 0;
  }
  flat_.copyTo(in_core_);
  // Along a low step noise leaves bridges; what is cut off with them, grow() gives back.
  cv::erode(flat_, flat_, cv::getStructuringElement(cv::MORPH_RECT, {5, 5}));
  cv::Mat1i components;
  const int count = cv::connectedComponents(flat_, components, 4, CV_32S);
  std::vector<int> area(static_cast<std::size_t>(count), 0);
  const auto* const component = components.ptr<int>();
  for (int i = 0; i < total; ++i) ++area[static_cast<std::size_t>(component[i])];
  const double smallest = 0.25 * kSmallest_m2 / (view.cell_m * view.cell_m);
  std::vector<int> renamed(static_cast<std::size_t>(count), 0);
  int next = 0;
  for (int i = 1; i < count; ++i) {
    if (area[static_cast<std::size_t>(i)] >= smallest) renamed[static_cast<std::size_t>(i)] = ++next;
  }
  segments_.labels.create(view.height.size());
  auto* const labels = segments_.labels.ptr<int>();
  for (int i = 0; i < total; ++i) labels[i] = renamed[static_cast<std::size_t>(component[i])];
  segments_.regions.assign(static_cast<std::size_t>(next), Region{});
}

// Rims, curved flanks and narrow parts belong to the core from which they can be reached without a step.
void Segmenter::grow(const TopView& view) {
  cv::Mat1i& labels = segments_.labels;
  front_.clear();
  for (int row = 0; row < labels.rows; ++row) {
    for (int column = 0; column < labels.cols; ++column) {
      if (labels(row, column) == 0) continue;
      const bool open = std::ranges::any_of(kAround, [&](const cv::Point& step) {
        const cv::Point to = cv::Point(column, row) + step;
        return view.contains(to) && labels(to) == 0 && foreground_(to) != 0;
      });
      if (open) front_.emplace_back(column, row);
    }
  }
  for (std::size_t i = 0; i < front_.size(); ++i) {
    const cv::Point from = front_[i];
    for (const cv::Point& step : kAround) {
      const cv::Point to = from + step;
      if (!view.contains(to) || labels(to) != 0 || foreground_(to) == 0) continue;
      if (std::abs(view.height(to) - view.height(from)) > kGrowStep) continue;
      labels(to) = labels(from);
      front_.push_back(to);
    }
  }
}

void Segmenter::collect() {
  for (std::size_t i = 0; i < segments_.regions.size(); ++i) {
    segments_.regions[i].label = static_cast<int>(i) + 1;
    segments_.regions[i].cells.clear();
    segments_.regions[i].core.clear();
  }
  const cv::Mat1i& labels = segments_.labels;
  for (int row = 0; row < labels.rows; ++row) {
    for (int column = 0; column < labels.cols; ++column) {
      const int label = labels(row, column);
      if (label == 0) continue;
      Region& region = segments_.regions[static_cast<std::size_t>(label - 1)];
      region.cells.emplace_back(column, row);
      if (in_core_(row, column) != 0) region.core.emplace_back(column, row);
    }
  }
}

void Segmenter::describe(const TopView& view, Region& region) const {
  const cv::Mat1i& labels = segments_.labels;
  const cv::Point below_camera = view.cell(view.camera_m.x(), view.camera_m.y());
  int outline = 0, hidden = 0, screened = 0, below = 0, crowded = 0, beside_robot = 0, border = 0;
  region.higher.clear();
  const int own_height = typical_height(view, region.core.empty() ? region.cells : region.core);
  for (const cv::Point& cell : region.cells) {
    if ((view.flags(cell) & TopView::kNearRobot) != 0) ++beside_robot;
    const bool inner = std::ranges::all_of(kAround, [&](const cv::Point& step) {
      return view.contains(cell + step) && labels(cell + step) == region.label;
    });
    const bool edge = (view.flags(cell) & TopView::kAtBorder) != 0 || cell.x < 2 || cell.y < 2 ||
                      cell.x >= labels.cols - 2 || cell.y >= labels.rows - 2;
    if (inner) continue;
    ++outline;
    border += edge ? 1 : 0;
    screened += (view.flags(cell) & TopView::kAtScreen) != 0 ? 1 : 0;
    const double dx = below_camera.x - cell.x, dy = below_camera.y - cell.y, distance = std::hypot(dx, dy);
    if (distance > 2 * kLook) {
      const cv::Point towards = cell + cv::Point(cvRound(kLook * dx / distance), cvRound(kLook * dy / distance));
      if (view.contains(towards) && view.height(towards) == TopView::kUnknown) ++hidden;
    }
    bool under = false, beside = false;
    for (const cv::Point& step : kAround8) {
      const cv::Point near = cell + kLook * step, far = cell + kCrowdedLook * step;
      if (view.contains(near) && labels(near) > 0 && labels(near) != region.label &&
          view.height(near) > own_height + kHigher) {
        under = true;
        region.higher.push_back(labels(near));
      }
      beside = beside || (view.contains(far) && labels(far) > 0 && labels(far) != region.label);
    }
    below += under ? 1 : 0;
    crowded += beside ? 1 : 0;
  }
  std::ranges::sort(region.higher);
  region.higher.erase(std::unique(region.higher.begin(), region.higher.end()), region.higher.end());
  region.hidden_share = outline > 0 ? static_cast<double>(hidden) / outline : 0;
  region.below_share = outline > 0 ? static_cast<double>(below) / outline : 0;
  region.crowded = crowded > 3;
  region.near_robot = beside_robot > 3;
  region.at_screen = screened > 3;
  region.border_share = outline > 0 ? static_cast<double>(border) / outline : 0;
}

void Segmenter::cut(std::size_t index, const Line& line) {
  const int label = static_cast<int>(segments_.regions.size()) + 1;
  Region& first = segments_.regions[index];
  Region second;
  second.label = label;
  second.near_robot = first.near_robot;
  second.at_screen = first.at_screen;
  const auto beyond = [&](const cv::Point& cell) { return line.beyond(cell); };
  std::ranges::copy_if(first.cells, std::back_inserter(second.cells), beyond);
  std::ranges::copy_if(first.core, std::back_inserter(second.core), beyond);
  std::erase_if(first.cells, beyond);
  std::erase_if(first.core, beyond);
  first.plane.reset();
  for (const cv::Point& cell : second.cells) segments_.labels(cell) = label;
  segments_.regions.push_back(std::move(second));
}

void Segmenter::fit_planes(const TopView& view) {
  std::vector<Region>& regions = segments_.regions;
  const auto some = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (regions[i].core.size() >= kFewestCells) regions[i].plane = fit_plane(view, regions[i].core);
    }
  };
  const std::size_t half = half_of(regions);
  both_([&] { some(0, half); }, [&] { some(half, regions.size()); });
}

// Objects that touch at equal height: first by colour, then by an outline that no single box has.
void Segmenter::split(const TopView& view) {
  fit_planes(view);
  int cuts = 0;
  for (std::size_t i = 0; i < segments_.regions.size(); ++i) {
    while (cuts < kMostCuts) {
      Region& region = segments_.regions[i];
      if (region.core.size() < kFewestCells) break;
      // A curve is shaded: its colours say nothing. Its core ends where it gets steep, with a ragged outline.
      if (!region.plane) region.plane = fit_plane(view, region.core);
      const bool curved = region.plane->curved();
      std::optional<Line> line;
      if (!curved) line = splitter_.by_colour(view, region.core);
      const bool whole = !region.near_robot && !region.at_screen && region.border_share == 0 &&
                         region.hidden_share < 0.03 && region.below_share < 0.05;
      if (!line && whole)
        line = splitter_.by_outline(curved ? region.cells : region.core, kNarrowestPiece_m / view.cell_m);
      if (!line) break;
      ++cuts;
      cut(i, *line);
    }
  }
}

void Segmenter::split_by_labels(const TopView& view, const std::vector<LabelMark>& marks) {
  const auto region_of = [&](const LabelMark& mark) {
    const cv::Point cell = mark.middle;
    return view.contains(cell) ? segments_.labels(cell) : 0;
  };
  for (std::size_t i = 0; i < marks.size(); ++i) {
    for (std::size_t j = i + 1; j < marks.size(); ++j) {
      const int label = region_of(marks[i]);
      if (label == 0 || region_of(marks[j]) != label) continue;
      const auto index = static_cast<std::size_t>(label - 1);
      const auto line = splitter_.between(view, segments_.regions[index].cells,
                                          {marks[i].middle, marks[j].middle, kHalfLabel_m / view.cell_m});
      if (line) cut(index, *line);
    }
  }
}

// Two that ride flush melt into one when noise hides the step between them.
void Segmenter::split_by_memory(const TopView& view, const std::vector<cv::RotatedRect>& known) {
  const double narrowest = kNarrowestPiece_m / view.cell_m;
  for (const cv::RotatedRect& one : known) {
    const double angle = one.angle * std::numbers::pi / 180;
    const cv::Point2d middle = one.center, along(std::cos(angle), std::sin(angle)), across(-along.y, along.x);
    const cv::Point cell = middle;
    const int label = view.contains(cell) ? segments_.labels(cell) : 0;
    if (label == 0) continue;
    const std::vector<cv::Point>& cells = segments_.regions[static_cast<std::size_t>(label - 1)].cells;
    for (const cv::Point2d& side : {along, -along, across, -across}) {
      const double half = 0.5 * (std::abs(side.dot(along)) > 0.5 ? one.size.width : one.size.height);
      const Line line{side, side.dot(middle) + half + kEdgeCells};
      const auto beyond = static_cast<double>(std::ranges::count_if(cells, [&](auto& c) { return line.beyond(c); }));
      const double inside = static_cast<double>(cells.size()) - beyond, area = one.size.area();
      if (beyond < narrowest * narrowest || inside < kStillThere * area || inside > area / kStillThere) continue;
      cut(static_cast<std::size_t>(label - 1), line);
      break;
    }
  }
}

const Segments& Segmenter::segment(const TopView& view, const std::vector<LabelMark>& marks,
                                   const std::vector<cv::RotatedRect>& known) {
  both_([&] { find_cores(view); }, [&] { splitter_.prepare(view); });
  grow(view);
  collect();
  for (Region& region : segments_.regions) describe(view, region);
  const std::size_t before = segments_.regions.size();
  split(view);
  split_by_memory(view, known);
  split_by_labels(view, marks);
  // What a hand holds stays one thing: pieces of it keep the mark of the whole.
  for (Region& region : segments_.regions) {
    if (segments_.regions.size() == before) break;
    const bool held = region.near_robot;
    describe(view, region);
    region.near_robot = region.near_robot || held;
  }
  drop_small(view);
  return segments_;
}

void Segmenter::drop_small(const TopView& view) {
  const double smallest = kSmallest_m2 / (view.cell_m * view.cell_m);
  std::vector<int> renamed(segments_.regions.size() + 1, 0);
  int kept = 0;
  for (Region& region : segments_.regions) {
    if (static_cast<double>(region.cells.size()) < smallest) continue;
    renamed[static_cast<std::size_t>(region.label)] = ++kept;
  }
  std::erase_if(segments_.regions,
                [&](const Region& region) { return renamed[static_cast<std::size_t>(region.label)] == 0; });
  for (Region& region : segments_.regions) {
    region.label = renamed[static_cast<std::size_t>(region.label)];
    for (int& label : region.higher) label = renamed[static_cast<std::size_t>(label)];
    std::erase(region.higher, 0);
  }
  auto* const labels = segments_.labels.ptr<int>();
  const int total = segments_.labels.rows * segments_.labels.cols;
  for (int i = 0; i < total; ++i) labels[i] = renamed[static_cast<std::size_t>(labels[i])];
}

}  // namespace pons::perception
