// Where frames change hands inside one process, as they do in shared memory between two.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <vector>

#include "pons/link/frames.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// What the cameras of a world need to hand their frames over.
[[nodiscard]] inline link::FramePages pages_of(const world::World& world) {
  std::vector<Intrinsics> cameras;
  for (const world::CameraSpec& camera : world.cameras) cameras.push_back(world::intrinsics(camera));
  return link::FramePages(cameras);
}

class Darkroom {
 public:
  explicit Darkroom(const world::World& world)
      : pages(pages_of(world)), memory_(new(kAligned) std::byte[pages.bytes()]) {}
  [[nodiscard]] std::byte* memory() const { return memory_.get(); }

  link::Frames frames;
  const link::FramePages pages;

 private:
  static constexpr std::align_val_t kAligned{4096};
  struct Free {
    void operator()(std::byte* memory) const { operator delete[](memory, kAligned); }
  };
  std::unique_ptr<std::byte[], Free> memory_;
};

}  // namespace pons::runner
