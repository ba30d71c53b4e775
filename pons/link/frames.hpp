// How camera frames reach the bridge, inside one process or in memory that two share: each camera has one place for one
// frame, which belongs to nobody, to the body (which exposes and develops it there) or to the bridge (which looks at it
// there). Only who holds a place hands it on, so nobody waits, no pixel is copied, and a side that is killed leaves
// every place with a holder. A bridge that does not give a place back costs frames, and nothing else.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/image.hpp"
#include "pons/core/time.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::link {

inline constexpr std::size_t kMaxCameras = 8;

// What the robot measured when the shutter was open.
struct Shot {
  Time stamp;
  ArmPositions joint_position;
  double belt_travel_m = 0;
};

// Who holds which place, and what was measured with its frame. No pointer is in it.
class Frames {
 public:
  enum class Holder : std::uint32_t { kNobody, kBody, kBridge };

  // ---- the body's side: one thread opens, one hands over ----

  [[nodiscard]] bool is_free(std::size_t camera) const { return holder(camera) == Holder::kNobody; }
  // Its frame is not developed yet.
  [[nodiscard]] bool in_the_dark(std::size_t camera) const { return holder(camera) == Holder::kBody; }
  // The place must be free.
  void open(std::size_t camera, const Shot& shot);
  // Its frame is developed.
  void hand_over(std::size_t camera);
  // A camera failed: nothing more will be handed over.
  void fail();
  // Whether a frame of a camera that reads labels would teach the bridge anything.
  [[nodiscard]] bool wants_labels() const { return wants_labels_.load(std::memory_order_relaxed); }

  // ---- the bridge's side: one thread looks and gives back; another may ask ----

  // A new bridge's first call, when the one before it is dead: gives back what that one held.
  void take_over();
  // Of the frames handed over, the one whose shutter opened first: all before it have been, too. Nothing: none has.
  [[nodiscard]] std::optional<std::size_t> oldest() const;
  [[nodiscard]] const Shot& shot(std::size_t camera) const { return places_[camera].shot; }
  void give_back(std::size_t camera);
  void want_labels(bool wanted) { wants_labels_.store(wanted, std::memory_order_relaxed); }
  // Any frame on its way, handed over or not, that was opened at `stamp` or before. In one process only, where the
  // asking thread is the one that opens.
  [[nodiscard]] bool under_way(std::size_t camera, Time stamp) const {
    return !is_free(camera) && places_[camera].shot.stamp <= stamp;
  }
  [[nodiscard]] bool failed() const { return failed_.load(std::memory_order_acquire); }

  // They change with every hand_over() and fail(); with every give_back() and fail().
  [[nodiscard]] rt::WakeWord& handed_over() { return handed_over_; }
  [[nodiscard]] rt::WakeWord& given_back() { return given_back_; }

 private:
  struct Place {
    std::atomic<Holder> holder{Holder::kNobody};
    Shot shot;
  };
  [[nodiscard]] Holder holder(std::size_t camera) const {
    return places_[camera].holder.load(std::memory_order_acquire);
  }

  std::array<Place, kMaxCameras> places_;
  std::atomic<bool> wants_labels_{false}, failed_{false};
  rt::WakeWord handed_over_, given_back_;
};

// Where the pixels of each camera's frame lie in one piece of memory.
class FramePages {
 public:
  explicit FramePages(std::span<const Intrinsics> cameras);

  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  // Lets `frame` lie in its camera's place of `memory`, which has bytes() and is aligned to a page.
  void lay(RgbdFrame& frame, std::size_t camera, std::byte* memory) const;

 private:
  struct Page {
    std::size_t rgb_at, rgb_count, depth_at, depth_count;
  };
  std::vector<Page> pages_;
  std::size_t bytes_ = 0;
};

}  // namespace pons::link
