// How many separate things lie where at first nothing lay.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "pons/core/image.hpp"
#include "pons/perception/self_filter.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// The first kLearn frames show the empty place; afterwards whatever stands 15 mm nearer to the camera, inside the place
// or falling into it, is a thing. What rides on the belt, passes over a rim or lies in a chute has not fallen, however
// near the place is below it.
class TrayWatch {
 public:
  static constexpr int kLearn = 3;

  TrayWatch(const world::World& world, const world::Place& place);

  // `robot` as SelfFilter::mask gives it.
  void process(const RgbdFrame& frame, const Sampling& sampling, const cv::Mat1b& robot);
  [[nodiscard]] int occupancy() const { return occupancy_; }

 private:
  // Along the world axes.
  struct Box {
    Vector3 low, high;
    [[nodiscard]] bool contains(const Vector3& at) const {
      return (at.array() >= low.array()).all() && (at.array() <= high.array()).all();
    }
  };

  void learn();
  [[nodiscard]] static Box box_of(const world::Place& place);
  [[nodiscard]] bool counts(const Vector3& at) const;

  Box watched_;
  std::vector<Box> chutes_;  // other places where things lie as they should
  int frames_ = 0;
  int occupancy_ = 0;
  cv::Mat1f empty_m_, depth_m_;
  cv::Mat1b things_;
};

}  // namespace pons::perception
