// Whether a camera or a lidar sees at all. Any thread.
#pragma once

#include <algorithm>
#include <cstddef>

#include "pons/core/image.hpp"

namespace pons::perception {

// By a sample of its readings: one in a hundred is enough. What is covered or broken has none; where there is nothing
// as far as it reaches, a lidar says so, by infinity.
[[nodiscard]] inline bool shows_anything(const RgbdFrame& frame) {
  constexpr std::size_t kSample = 1000, kOneIn = 100;
  const std::size_t pixels = frame.depth_m.size(), stride = std::max<std::size_t>(1, pixels / kSample);
  std::size_t looked_at = 0, read = 0;
  for (std::size_t i = 0; i < pixels; i += stride, ++looked_at) read += frame.depth_m[i] > 0 ? 1U : 0U;
  return read * kOneIn >= looked_at;
}

}  // namespace pons::perception
