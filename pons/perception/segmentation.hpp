// Which cells of a top view belong to one object.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/both.hpp"
#include "pons/perception/plane.hpp"
#include "pons/perception/splitter.hpp"
#include "pons/perception/top_view.hpp"

namespace pons::perception {

// Shares are of the outline's cells.
struct Region {
  int label = 0;                 // in Segments::labels
  std::vector<cv::Point> cells;  // all, row by row
  std::vector<cv::Point> core;   // those away from steps in height
  double hidden_share = 0;       // towards the camera nothing was seen: something nearer hides the rest
  double below_share = 0;        // adjoins something higher
  bool crowded = false;          // another object within about 8 mm
  bool near_robot = false;       // beside or under the robot, or in its hand
  bool at_screen = false;        // beside what hangs before the camera
  double border_share = 0;       // cut by the picture or the belt's limits
  std::vector<int> higher;       // labels of the higher neighbours, ascending
  std::optional<Plane> plane;    // that fits the core, where that was asked for
};

// A core of fewer says nothing about its shape.
inline constexpr std::size_t kFewestCells = 20;

// Of the regions, how many from the first on hold half of the cells.
[[nodiscard]] std::size_t half_of(const std::vector<Region>& regions);

struct Segments {
  cv::Mat1i labels;             // 0: no object
  std::vector<Region> regions;  // regions[i].label == i + 1
};

// Where a label was read: its code and its middle, in cells.
struct LabelMark {
  std::string code;
  cv::Point2d middle;
};

class Segmenter {
 public:
  explicit Segmenter(Both both) : both_(std::move(both)) {}

  // No region keeps two of `marks`: every object has one code. What was seen to end where one of `known` does (in
  // cells) still ends there. The result is good until the next call.
  const Segments& segment(const TopView& view, const std::vector<LabelMark>& marks = {},
                          const std::vector<cv::RotatedRect>& known = {});
  // Cells with fine print (a label's modules), of the last call.
  [[nodiscard]] const cv::Mat1b& texture() const { return splitter_.texture(); }

 private:
  void find_cores(const TopView& view);
  void grow(const TopView& view);
  void collect();
  void fit_planes(const TopView& view);
  void split(const TopView& view);
  void split_by_labels(const TopView& view, const std::vector<LabelMark>& marks);
  void split_by_memory(const TopView& view, const std::vector<cv::RotatedRect>& known);
  void describe(const TopView& view, Region& region) const;
  void cut(std::size_t region, const Line& line);
  void drop_small(const TopView& view);

  Both both_;
  Splitter splitter_;
  cv::Mat1b foreground_, flat_;
  cv::Mat1w high_, low_;
  std::vector<cv::Point> front_;
  cv::Mat1b in_core_;
  Segments segments_;
};

}  // namespace pons::perception
