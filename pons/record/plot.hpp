// The geometry of a plot of dots, as a template draws it: all lengths in the picture's own units, y downwards.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace pons::record {

struct Dot {
  double x = 0, y = 0;
  std::string kind;    // a class of the page's style
  std::string title;   // said of it
  std::string target;  // of the page, to go to
};

struct Axis {
  std::string label;
  double least = 0, most = 1;      // widened to round numbers, least to most where they are equal
  std::vector<std::string> names;  // of 0, 1, 2 …, instead of numbers
};

struct Plot {
  std::string title, about;
  Axis x, y;
  std::vector<Dot> dots;
  struct Level {
    double from = 0, to = 0;  // of y; a line where they are equal
    std::string label;
  };
  std::vector<Level> levels;
};

inline constexpr int kPlotWidth = 360, kPlotHeight = 220;

// Up to about `most` round numbers from at or below `low` to at or above `high`, evenly apart.
[[nodiscard]] std::vector<double> ticks(double low, double high, int most);

// {title, about, x_label, y_label, left, right, top, bottom, x_ticks, y_ticks, bands, lines, dots}
[[nodiscard]] nlohmann::ordered_json view_of(const Plot& plot);

}  // namespace pons::record
