// Which pixels see the robot itself, from its own capsules at the joint positions of the shutter's moment.
#pragma once

#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "pons/core/both.hpp"
#include "pons/core/image.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::perception {

// A picture read every `step` pixels: sample (row, column) is pixel (row · step, column · step).
struct Sampling {
  int step = 1;
  int width = 0, height = 0;              // samples
  double fx = 0, fy = 0, cx = 0, cy = 0;  // of the sampled picture

  explicit Sampling(const Intrinsics& full, int wanted_width = 800);
  [[nodiscard]] float depth(const RgbdFrame& frame, int row, int column) const {
    return frame.depth_m[static_cast<std::size_t>(row * step) * static_cast<std::size_t>(frame.intrinsics.width) +
                         static_cast<std::size_t>(column * step)];
  }
  // `count` samples of a row from `column` on: in place where every pixel is one, else copied into `copy`.
  [[nodiscard]] const float* row(const RgbdFrame& frame, int row, int column, int count,
                                 std::vector<float>& copy) const {
    const float* const from = frame.depth_m.data() + static_cast<std::ptrdiff_t>(row) * step * frame.intrinsics.width +
                              static_cast<std::ptrdiff_t>(column) * step;
    if (step == 1) return from;
    copy.resize(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) copy[static_cast<std::size_t>(i)] = from[static_cast<std::ptrdiff_t>(i) * step];
    return copy.data();
  }
};

class SelfFilter {
 public:
  static constexpr std::uint8_t kRobot = 255;  // sees the robot
  static constexpr std::uint8_t kNear = 128;   // within about 1.5 cm of such a pixel

  explicit SelfFilter(model::RobotModel model, Both both = one_after_the_other);
  // Another robot that may be in the picture, at most kMaxArms in all; before the first frame.
  void add(model::RobotModel model) { models_.push_back(std::move(model)); }

  // Good until the next call. One value a sample.
  const cv::Mat1b& mask(const RgbdFrame& frame, const Sampling& sampling, const ArmPositions& joint_position);

 private:
  // A capsule in the optical frame, and the samples that may see it.
  struct Shape {
    Eigen::Vector3f from, along;
    float inverse_squared_length = 0, squared_radius = 0;
    cv::Rect window;
  };

  [[nodiscard]] static Shape shape_of(const model::PlacedCapsule& capsule, const Pose& optical_from_world,
                                      const Sampling& sampling);
  static void paint_row(const Shape& s, const float* depth, int count, float first_x, float step_x, float y,
                        std::uint8_t* robot);
  // Of the rows from `begin` to `end`.
  void paint(const RgbdFrame& frame, const Sampling& sampling, int begin, int end);

  Both both_;
  std::vector<model::RobotModel> models_;
  std::vector<model::PlacedCapsule> capsules_;
  std::vector<Shape> shapes_;
  cv::Mat1b robot_, mask_;
};

}  // namespace pons::perception
