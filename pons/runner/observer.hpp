// The bridge's half of the camera crew: turns frames into beliefs on a thread of its own. Frames are taken in strictly
// by shutter time and beliefs come out with the camera's modelled latency, so the result does not depend on how fast
// the threads are.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/link/frames.hpp"
#include "pons/perception/sight.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// What perception believed once a frame was taken in.
struct Snapshot {
  Time stamp;                              // of the frame
  Time belt_seen;                          // stamp of the newest frame of the belt so far,
  Time belt_clear;                         // and of the newest that showed all of it
  Time due;                                // stamp plus the camera's latency
  double belt_travel_m = 0;                // at the stamp
  std::vector<ObjectBelief> objects, cut;  // Perception::beliefs(), cut()
  std::map<std::string, int> occupancy;    // of watched places
  bool wants_labels = false;               // Perception::wants_labels()
  std::optional<BaseBelief> base = {};     // where the base is, in a world that has one
  std::vector<Time> shown = {};            // a camera: stamp of its newest frame that showed anything at all
};

class Observer {
 public:
  // All must outlive it; `memory` is what `pages` describe. In lockstep, collect() waits for a frame that is due; in
  // real time a late frame is skipped over. What an earlier observer held of `frames` is given back unseen.
  Observer(const world::World& world, perception::Sight& perception, link::Frames& frames,
           const link::FramePages& pages, std::byte* memory, Pace pace);
  ~Observer();
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  // On the bridge's thread: the newest snapshot that is due, if there is a new one. Perception forgets `forgotten`
  // tracks before the next frame that is taken after `now`.
  [[nodiscard]] std::optional<Snapshot> collect(Time now, const std::vector<std::uint32_t>& forgotten);

  // Whether any camera watches the belt.
  [[nodiscard]] bool watches_belt() const;

 private:
  void perceive(const std::stop_token& stop);
  [[nodiscard]] Snapshot take_in(std::size_t camera);
  void wait_for_what_is_due(Time now);
  [[nodiscard]] Duration latency(std::size_t camera) const;

  const world::World& world_;
  perception::Sight& perception_;
  link::Frames& places_;
  Pace pace_;
  std::vector<RgbdFrame> frames_;  // a camera; the perceiver's only,
  std::vector<Time> shown_;        // and so are these
  Time belt_seen_, belt_clear_;

  std::mutex mutex_;
  std::deque<Snapshot> snapshots_;                        // taken in, by stamp
  std::deque<std::pair<Time, std::uint32_t>> to_forget_;  // tracks, and when they went
  std::jthread perceiver_;
};

}  // namespace pons::runner
