// How many separate things lie where at first nothing lay.
#pragma once

#include <opencv2/core.hpp>

#include "pons/core/image.hpp"
#include "pons/perception/self_filter.hpp"
#include "pons/world/world.hpp"

namespace pons::perception {

// The first kLearn frames show the empty place; afterwards whatever stands 15 mm nearer to the camera, inside the
// place, is a thing.
class TrayWatch {
 public:
  static constexpr int kLearn = 3;

  explicit TrayWatch(world::Place place) : place_(std::move(place)) {}

  // `robot` as SelfFilter::mask gives it.
  void process(const RgbdFrame& frame, const Sampling& sampling, const cv::Mat1b& robot);
  [[nodiscard]] const world::Place& place() const { return place_; }
  [[nodiscard]] int occupancy() const { return occupancy_; }

 private:
  world::Place place_;
  int frames_ = 0;
  int occupancy_ = 0;
  cv::Mat1f empty_m_, depth_m_;
  cv::Mat1b things_;
};

}  // namespace pons::perception
