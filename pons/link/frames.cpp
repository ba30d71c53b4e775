#include "pons/link/frames.hpp"

namespace pons::link {

void Frames::open(std::size_t camera, const Shot& shot) {
  places_[camera].shot = shot;
  places_[camera].holder.store(Holder::kBody, std::memory_order_release);
}

void Frames::hand_over(std::size_t camera) {
  places_[camera].holder.store(Holder::kBridge, std::memory_order_release);  // after the last pixel
  handed_over_.bump();
}

void Frames::fail() {
  failed_.store(true, std::memory_order_release);
  handed_over_.bump();
  given_back_.bump();
}

void Frames::take_over() {
  for (std::size_t camera = 0; camera < kMaxCameras; ++camera) {
    if (holder(camera) == Holder::kBridge) give_back(camera);
  }
  want_labels(false);
}

std::optional<std::size_t> Frames::oldest() const {
  std::optional<std::size_t> first;
  // An older one may have been handed over behind the first look's back, but not behind the second's: it came before
  // what the first has found.
  for (int look = 0; look < 2; ++look) {
    for (std::size_t camera = 0; camera < kMaxCameras; ++camera) {
      if (holder(camera) != Holder::kBridge) continue;
      if (!first || places_[camera].shot.stamp < places_[*first].shot.stamp) first = camera;
    }
    if (!first) break;
  }
  return first;
}

void Frames::give_back(std::size_t camera) {
  places_[camera].holder.store(Holder::kNobody, std::memory_order_release);  // after the last look
  given_back_.bump();
}

FramePages::FramePages(std::span<const Intrinsics> cameras) {
  constexpr std::size_t kPage = 4096;
  const auto take = [this](std::size_t bytes) {
    const std::size_t at = bytes_;
    bytes_ += (bytes + kPage - 1) / kPage * kPage;
    return at;
  };
  for (const Intrinsics& camera : cameras) {
    const auto pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
    const std::size_t rgb_at = take(3 * pixels);
    pages_.push_back({rgb_at, 3 * pixels, take(pixels * sizeof(float)), pixels});
  }
}

void FramePages::lay(RgbdFrame& frame, std::size_t camera, std::byte* memory) const {
  const Page& page = pages_[camera];
  frame.rgb.lie_in({reinterpret_cast<std::uint8_t*>(memory + page.rgb_at), page.rgb_count});
  frame.depth_m.lie_in({reinterpret_cast<float*>(memory + page.depth_at), page.depth_count});
}

}  // namespace pons::link
