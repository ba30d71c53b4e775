// What a colour-and-depth camera delivers, and how its pixels map to space.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/core/time.hpp"

namespace pons {

// Pinhole, no distortion. The optical frame is x right, y down, z forward (REP-103). Pixel centres are integers.
struct Intrinsics {
  int width = 0, height = 0;              // px
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px
};

// One frame. Row 0 is the top row.
struct RgbdFrame {
  std::string camera;
  Time stamp;  // when the shutter was open, not when the frame arrived
  Intrinsics intrinsics;
  Pose world_from_optical = Pose::Identity();
  std::vector<std::uint8_t> rgb;  // height × width × 3
  std::vector<float> depth_m;     // height × width, along the optical z; 0 where the sensor has no reading
};

}  // namespace pons
