#include "pons/world/grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

namespace pons::world {
namespace {

constexpr double kNone = 1e12;  // squared cells: where nothing is, near or far

// Squared distances along one line of cells, from what each has already: the lower envelope of parabolas (Felzenszwalb
// and Huttenlocher 2012, "Distance Transforms of Sampled Functions").
void transform(std::vector<double>& line, std::vector<double>& out, std::vector<std::size_t>& at,
               std::vector<double>& from) {
  const std::size_t count = line.size();
  std::size_t last = 0;
  at[0] = 0;
  from[0] = -std::numeric_limits<double>::infinity();
  from[1] = std::numeric_limits<double>::infinity();
  const auto meet = [&](std::size_t q, std::size_t p) {
    const auto a = static_cast<double>(q), b = static_cast<double>(p);
    return ((line[q] + a * a) - (line[p] + b * b)) / (2 * a - 2 * b);
  };
  for (std::size_t q = 1; q < count; ++q) {
    double s = meet(q, at[last]);
    while (s <= from[last]) s = meet(q, at[--last]);
    at[++last] = q;
    from[last] = s;
    from[last + 1] = std::numeric_limits<double>::infinity();
  }
  last = 0;
  for (std::size_t q = 0; q < count; ++q) {
    while (from[last + 1] < static_cast<double>(q)) ++last;
    const double away = static_cast<double>(q) - static_cast<double>(at[last]);
    out[q] = away * away + line[at[last]];
  }
  std::swap(line, out);
}

// From the middle of each cell to that of the nearest one with `wanted`, squared, in cells.
std::vector<double> squared_distances(std::span<const Ground> ground, int width, int height, bool occupied) {
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  std::vector<double> field(ground.size());
  for (std::size_t i = 0; i < ground.size(); ++i) field[i] = (ground[i] == Ground::kOccupied) == occupied ? 0.0 : kNone;
  const std::size_t longest = std::max(columns, rows);
  std::vector<double> line, out, from(longest + 1);
  std::vector<std::size_t> at(longest);
  line.resize(rows);
  out.resize(rows);
  for (std::size_t x = 0; x < columns; ++x) {
    for (std::size_t y = 0; y < rows; ++y) line[y] = field[y * columns + x];
    transform(line, out, at, from);
    for (std::size_t y = 0; y < rows; ++y) field[y * columns + x] = line[y];
  }
  line.resize(columns);
  out.resize(columns);
  for (std::size_t y = 0; y < rows; ++y) {
    const auto row = field.begin() + static_cast<std::ptrdiff_t>(y * columns);
    std::copy_n(row, columns, line.begin());
    transform(line, out, at, from);
    std::ranges::copy(line, row);
  }
  return field;
}

}  // namespace

Grid::Grid(int width, int height, double resolution_m, const Vector2& origin_m, std::vector<Ground> ground)
    : width_(width),
      height_(height),
      resolution_m_(resolution_m),
      origin_m_(origin_m),
      ground_(std::move(ground)),
      distance_(ground_.size()) {
  const std::vector<double> outside = squared_distances(ground_, width_, height_, true);
  const std::vector<double> inside = squared_distances(ground_, width_, height_, false);
  // From middle to middle; the edge lies half a cell before the one.
  for (std::size_t i = 0; i < distance_.size(); ++i) {
    const bool occupied = ground_[i] == Ground::kOccupied;
    const double cells = std::sqrt(occupied ? inside[i] : outside[i]) - 0.5;
    distance_[i] = static_cast<float>((occupied ? -cells : cells) * resolution_m_);
  }
}

bool Grid::contains(const Vector2& at) const {
  const Vector2 cell = (at - origin_m_) / resolution_m_;
  return cell.x() >= 0 && cell.y() >= 0 && cell.x() < width_ && cell.y() < height_;
}

int Grid::column(double x) const { return static_cast<int>(std::floor((x - origin_m_.x()) / resolution_m_)); }
int Grid::row(double y) const { return static_cast<int>(std::floor((y - origin_m_.y()) / resolution_m_)); }

Vector2 Grid::middle(int column, int row) const { return origin_m_ + resolution_m_ * Vector2(column + 0.5, row + 0.5); }

Ground Grid::ground(const Vector2& at) const {
  return contains(at) ? ground(column(at.x()), row(at.y())) : Ground::kUnknown;
}

Grid::Between Grid::between(const Vector2& at) const {
  const Vector2 cell = (at - origin_m_) / resolution_m_ - Vector2(0.5, 0.5);
  const double x = std::clamp(cell.x(), 0.0, width_ - 1.0), y = std::clamp(cell.y(), 0.0, height_ - 1.0);
  const int column = std::min(static_cast<int>(x), width_ - 2), row = std::min(static_cast<int>(y), height_ - 2);
  return {column, row, x - column, y - row};
}

double Grid::distance_m(const Vector2& at) const {
  const auto [column, row, right, up] = between(at);
  const double below = (1 - right) * distance_m(column, row) + right * distance_m(column + 1, row);
  const double above = (1 - right) * distance_m(column, row + 1) + right * distance_m(column + 1, row + 1);
  return (1 - up) * below + up * above;
}

Vector2 Grid::gradient(const Vector2& at) const {
  const auto [column, row, right, up] = between(at);
  const double a = distance_m(column, row), b = distance_m(column + 1, row);
  const double c = distance_m(column, row + 1), d = distance_m(column + 1, row + 1);
  return Vector2((1 - up) * (b - a) + up * (d - c), (1 - right) * (c - a) + right * (d - b)) / resolution_m_;
}

}  // namespace pons::world
