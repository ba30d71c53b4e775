// What a colour-and-depth camera delivers, and how its pixels map to space.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/core/time.hpp"

namespace pons {

// Pinhole, no distortion. The optical frame is x right, y down, z forward (REP-103). Pixel centres are integers.
struct Intrinsics {
  int width = 0, height = 0;              // px
  double fx = 0, fy = 0, cx = 0, cy = 0;  // px
};

// The pixels of a picture, in memory of their own or in somebody else's: a frame that goes to another process is
// written where that one reads it. A copy has memory of its own.
template <typename T>
class PixelArray {
 public:
  PixelArray() = default;
  ~PixelArray() = default;
  PixelArray(const PixelArray& other) : own_(other.begin(), other.end()), pixels_(own_) {}
  PixelArray(PixelArray&& other) noexcept
      : own_(std::move(other.own_)), pixels_(std::exchange(other.pixels_, std::span<T>{})) {}
  PixelArray& operator=(PixelArray other) noexcept {
    std::swap(own_, other.own_);
    std::swap(pixels_, other.pixels_);
    return *this;
  }

  // From here on its pixels lie there; that memory must outlive it.
  void lie_in(std::span<T> memory) {
    own_.clear();
    pixels_ = memory;
  }
  // Stays where it lies when that has `count` pixels, else gets memory of its own, with nothing in it.
  void resize(std::size_t count) {
    if (pixels_.size() == count) return;
    own_.assign(count, T{});
    pixels_ = own_;
  }

  [[nodiscard]] std::size_t size() const { return pixels_.size(); }
  [[nodiscard]] T* data() { return pixels_.data(); }
  [[nodiscard]] const T* data() const { return pixels_.data(); }
  [[nodiscard]] T& operator[](std::size_t i) { return pixels_[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const { return pixels_[i]; }
  [[nodiscard]] const T* begin() const { return pixels_.data(); }
  [[nodiscard]] const T* end() const { return pixels_.data() + pixels_.size(); }
  bool operator==(const PixelArray& other) const { return std::equal(begin(), end(), other.begin(), other.end()); }

 private:
  std::vector<T> own_;
  std::span<T> pixels_;
};

// One frame. Row 0 is the top row.
struct RgbdFrame {
  std::string camera;
  Time stamp;  // when the shutter was open, not when the frame arrived
  Intrinsics intrinsics;
  Pose world_from_optical = Pose::Identity();
  PixelArray<std::uint8_t> rgb;  // height × width × 3
  PixelArray<float> depth_m;     // height × width, along the optical z; 0 where the sensor has no reading. Of a lidar
                                 // the ranges; infinity where nothing came back because nothing is near enough
};

}  // namespace pons
