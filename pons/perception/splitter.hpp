// Where to cut a patch of equal height that is more than one object. Two convex things that do not overlap can always
// be told apart by a straight line, so lines are all it looks for.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "pons/perception/top_view.hpp"

namespace pons::perception {

// In cells: the points with normal · p > offset lie beyond it.
struct Line {
  cv::Point2d normal;
  double offset = 0;
  [[nodiscard]] bool beyond(cv::Point2d point) const { return normal.dot(point) > offset; }
};

class Splitter {
 public:
  // Call once a view: marks fine print, whose colours say nothing about the object's own.
  void prepare(const TopView& view);
  [[nodiscard]] const cv::Mat1b& texture() const { return texture_; }

  // A line between two plain colours with a sharp edge. Maximises the variance between both sides (Otsu 1979).
  [[nodiscard]] std::optional<Line> by_colour(const TopView& view, const std::vector<cv::Point>& cells);
  // The middles of two labels, in cells; no line between them comes nearer to either than `clear` cells.
  struct Labels {
    cv::Point2d one, other;
    double clear = 0;
  };
  // The line between two labels that tells colour or height of the two sides apart; where they are alike, one through
  // an inward corner that leaves better rectangles. None: as far as can be told it is one thing that shows both.
  [[nodiscard]] std::optional<Line> between(const TopView& view, const std::vector<cv::Point>& cells,
                                            const Labels& labels);
  // A line through an inward corner of the outline that leaves two better rectangles, none of them narrower than
  // `narrowest` cells, and cuts no print; the shortest of nearly equal ones.
  [[nodiscard]] std::optional<Line> by_outline(const std::vector<cv::Point>& cells, double narrowest = 0) const;

 private:
  struct Sample {
    cv::Point2f at;
    cv::Vec3f colour;  // or what stands for it
  };
  struct Cut {
    double angle_rad = 0, offset = 0;
    double explained = 0;  // share of the colour's variance
    double contrast = 0;   // distance between the two sides' means
  };
  template <typename Features>
  double take_samples(const std::vector<cv::Point>& cells, const Features& features);
  // Of the cuts at that angle with an offset between `from` and `to`.
  [[nodiscard]] Cut best_cut(double angle_rad, double bin, double total_variance, double from = -1e9,
                             double to = 1e9) const;
  [[nodiscard]] bool sharp(const Cut& cut) const;
  struct Told {
    Line line;
    double explained = 0;  // share of the variance
    bool sharp = false;    // it jumps right at the line
    double step_m = 0;     // between the mean heights of both sides
  };
  [[nodiscard]] std::optional<Told> between_colours(const TopView& view, const std::vector<cv::Point>& cells,
                                                    const Labels& labels);
  [[nodiscard]] static std::optional<Line> between_corners(const std::vector<cv::Point>& cells, const Labels& labels);

  cv::Mat1b texture_, grey_, brightest_, darkest_;
  std::vector<Sample> samples_;
};

// The share of its smallest enclosing rectangle that a set of cells fills.
[[nodiscard]] double rectangle_fill(const std::vector<cv::Point>& cells);

}  // namespace pons::perception
