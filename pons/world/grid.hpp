// A floor's map as an occupancy grid, as ROS's map_server keeps one (a PGM picture and a YAML file that says where it
// lies), with the distance from every point to what stands there. Immutable.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "pons/core/pose2.hpp"

namespace pons::world {

enum class Ground : std::uint8_t { kFree, kOccupied, kUnknown };

class Grid {
 public:
  // `ground` is row by row from the lowest y, each from the lowest x; `origin` is the grid's lowest corner, map frame.
  Grid(int width, int height, double resolution_m, const Vector2& origin_m, std::vector<Ground> ground);

  // Loading only: throws LoadError that names the file and what is wrong with it. `yaml` as map_server reads it: image,
  // resolution, origin [x, y, 0], negate, occupied_thresh, free_thresh, mode trinary; the image is binary PGM (P5) with
  // one byte a cell.
  [[nodiscard]] static Grid load(const std::filesystem::path& yaml);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double resolution_m() const { return resolution_m_; }
  [[nodiscard]] const Vector2& origin_m() const { return origin_m_; }

  [[nodiscard]] bool contains(const Vector2& at) const;
  // kUnknown outside.
  [[nodiscard]] Ground ground(const Vector2& at) const;
  [[nodiscard]] Ground ground(int column, int row) const { return ground_[index(column, row)]; }
  // The middle of a cell; the cell of a point, which may lie outside.
  [[nodiscard]] Vector2 middle(int column, int row) const;
  [[nodiscard]] int column(double x) const;
  [[nodiscard]] int row(double y) const;

  // How far it is to the nearest edge of something occupied, below 0 within it; linear between cells. Outside the map
  // that of the nearest point inside.
  [[nodiscard]] double distance_m(const Vector2& at) const;
  [[nodiscard]] double distance_m(int column, int row) const { return distance_[index(column, row)]; }
  // Of distance_m() there; 1 long in the open, away from ridges.
  [[nodiscard]] Vector2 gradient(const Vector2& at) const;

 private:
  // The four cells around a point, and how far it is between them (0 to 1).
  struct Between {
    int column, row;
    double right, up;
  };
  [[nodiscard]] Between between(const Vector2& at) const;
  [[nodiscard]] std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
  }

  int width_, height_;
  double resolution_m_;
  Vector2 origin_m_;
  std::vector<Ground> ground_;
  std::vector<float> distance_;
};

}  // namespace pons::world
