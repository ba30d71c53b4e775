// The body's half of the camera crew: opens the shutters on time, and develops what they saw on a thread of its own,
// into the places from which the bridge's half takes it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/link/frames.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

enum class Pace : std::uint8_t { kLockstep, kRealTime };

class Photographer {
 public:
  // All must outlive it; `memory` is what `pages` describe. In lockstep a shutter waits for its camera's place; in real
  // time a camera whose place is taken skips its turn.
  Photographer(const world::World& world, std::vector<body::Camera*> cameras, link::Frames& frames,
               const link::FramePages& pages, std::byte* memory, Pace pace);
  ~Photographer();
  Photographer(const Photographer&) = delete;
  Photographer& operator=(const Photographer&) = delete;

  // On the thread that advances the body, after each advance. A camera that reads labels skips its turn while nothing
  // that it could read is known to lie unread. Another that hangs in the same place skips the turns that both have and
  // the reading one takes: they are one camera, which takes one picture at a time.
  // `sensors` are those of each robot, at least one.
  void open_shutters(Time now, std::span<const body::Sensors> sensors);

  // In lockstep, on that thread: who looked at the frames is no more, and the cameras skip their turns until another
  // does. What is exposed is developed first, so that whoever comes finds the same, however fast the developer is.
  void nobody_looks();
  void somebody_looks() { looked_at_ = true; }

  // Error: a camera failed; no frame comes any more. Any thread.
  [[nodiscard]] Expected<void> health() const;

 private:
  [[nodiscard]] bool wants(std::size_t camera, Time now) const;
  void develop(const std::stop_token& stop);
  // False: a camera failed.
  [[nodiscard]] bool wait_for_place(std::size_t camera);

  const world::World& world_;
  std::vector<body::Camera*> cameras_;
  link::Frames& places_;
  Pace pace_;
  bool finds_ = false;              // what lies on the belt, some camera that reads no labels
  bool looked_at_ = true;           // the body's thread only
  std::vector<Time> next_shutter_;  // a camera; the body's thread only, as are
  std::vector<std::size_t> turn_;   // the cameras, in the order in which they take their turns,
  std::vector<Time> opened_;        // and when each last opened its shutter
  std::vector<RgbdFrame> frames_;   // a camera; the developer's only

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::size_t> exposed_;  // cameras, in the order of their shutters
  std::optional<Error> error_;
  std::jthread developer_;
};

}  // namespace pons::runner
