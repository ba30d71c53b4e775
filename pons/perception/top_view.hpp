// A depth picture turned into a map seen from straight above: metric, without perspective, the same for any camera
// pose. Hidden belt stays unknown instead of being guessed, so an object's outline can be told from the edge of what
// was seen.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "pons/core/both.hpp"
#include "pons/core/image.hpp"
#include "pons/perception/self_filter.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// Columns run along world +x, rows along world +y. Cell (row, column) covers cell_m × cell_m from its lower corner.
struct TopView {
  static constexpr std::uint16_t kUnknown = 0;   // in `height`: nothing was seen there
  static constexpr int kLevel = 5000;            // in `height`: the belt's surface; one step is 0.1 mm
  static constexpr std::uint8_t kNearRobot = 1;  // in `flags`: seen beside the robot, so perhaps hidden by it in part
  static constexpr std::uint8_t kAtBorder = 2;   // seen at the picture's border or the belt's limits, so perhaps cut
  static constexpr std::uint8_t kAtScreen = 4;   // seen beside what hangs before the camera, so perhaps hidden by it

  double cell_m = 0;
  double x0_m = 0, y0_m = 0;           // world, lower corner of cell (0, 0)
  double surface_z_m = 0;              // world
  Vector3 camera_m = Vector3::Zero();  // world
  cv::Mat1w height;                    // median filtered
  cv::Mat3b colour;                    // red, green, blue; black where nothing stands on the belt
  cv::Mat1b flags;

  bool clear = true;  // no part of the window is without readings but where the robot hides it

  [[nodiscard]] static double metres(std::uint16_t height) { return 1e-4 * (height - kLevel); }
  [[nodiscard]] static std::uint16_t steps(double height_m) {
    return static_cast<std::uint16_t>(kLevel + static_cast<int>(height_m * 1e4));
  }
  // The middle of a cell, world (m).
  [[nodiscard]] Eigen::Vector2d xy(cv::Point cell) const {
    return {x0_m + (cell.x + 0.5) * cell_m, y0_m + (cell.y + 0.5) * cell_m};
  }
  [[nodiscard]] cv::Point cell(double x_m, double y_m) const {
    return {cvFloor((x_m - x0_m) / cell_m), cvFloor((y_m - y0_m) / cell_m)};
  }
  [[nodiscard]] bool contains(cv::Point cell) const {
    return cell.x >= 0 && cell.y >= 0 && cell.x < height.cols && cell.y < height.rows;
  }
};

// Makes the maps of one camera and keeps what depends on its geometry only.
class TopViewer {
 public:
  // `frame` is any frame of the camera: intrinsics and pose must stay.
  TopViewer(const RgbdFrame& frame, const world::Belt& belt, Both both);

  // The picture as this class samples it: every so many pixels, about 800 a row.
  [[nodiscard]] const Sampling& sampling() const { return sampling_; }
  [[nodiscard]] bool fits(const RgbdFrame& frame) const;
  // `robot` as SelfFilter::mask gives it. The result is good until the next call.
  const TopView& build(const RgbdFrame& frame, const cv::Mat1b& robot);

 private:
  struct Reading {
    int cell = 0;
    std::int16_t column = 0, row = 0;  // sample
    std::uint16_t height = 0;
  };
  // What hangs before the camera, or a camera without light, leaves whole tiles of the window without readings.
  static constexpr std::size_t kTiles = 16;
  // What was read of the highest surface of one cell: the sum of its heights, how many there are, the last one's
  // colour.
  struct Pile {
    int sum = 0;
    std::uint16_t count = 0;
    cv::Vec3b colour;
    std::uint8_t flags = 0;
  };
  // Some rows of samples, and the map as they alone would make it.
  struct Strip {
    int begin = 0, end = 0;
    std::vector<float> depth_row;  // of one row of samples in the window:
    std::vector<int> cell_row;     // −1: nothing there
    std::vector<int> height_row;
    std::vector<Reading> raised;  // above bare belt; the first raised_count
    std::size_t raised_count = 0;
    cv::Mat1w highest;
    std::array<int, kTiles> read{}, unread{};  // samples, by tile along the belt
    std::vector<Pile> piles;                   // a cell
    cv::Mat1b flags;
  };

  void project(const RgbdFrame& frame, int row, Strip& strip) const;
  void drop_robot(const std::uint8_t* seen, int from, int to, Strip& strip) const;
  void count_readings(int row, Strip& strip);
  void find_highest(const RgbdFrame& frame, const cv::Mat1b& robot, cv::Rect near, Strip& strip);
  void find_screen();
  void accumulate(const RgbdFrame& frame, Strip& strip) const;
  // Of the map's rows from `begin` to `end`:
  void merge(int begin, int end);
  void fill_pinholes(int begin, int end);
  void smooth(int begin, int end);
  // Does it for each half of the map's rows.
  template <typename Work>
  void halves(const Work& work);

  Both both_;
  Sampling sampling_;
  Pose world_from_optical_;
  cv::Rect window_;  // of the sampled picture: what can see the belt
  std::array<Strip, 2> strips_;
  cv::Mat1b screen_;  // of the window: samples that are hidden; once it is found, those beside them, too
  bool has_screen_ = false;
  cv::Mat1w highest_, filled_;
  TopView view_;
};

}  // namespace pons::perception
