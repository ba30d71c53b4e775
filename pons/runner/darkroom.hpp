// Opens the shutters on time and turns frames into beliefs on threads of its own, so that rendering, vision and physics
// overlap: one develops frames, the other takes in what is developed. Frames are taken in strictly by shutter time and
// beliefs come out with the camera's modelled latency, so the result does not depend on how fast the threads are.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/belief.hpp"
#include "pons/perception/perception.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

// What perception believed once a frame was taken in.
struct Snapshot {
  Time stamp;                                 // of the frame
  Time due;                                   // stamp plus the camera's latency
  double belt_travel_m = 0;                   // at the stamp
  std::vector<ObjectBelief> objects, coming;  // Perception::beliefs(), coming()
  std::map<std::string, int> occupancy;       // of watched places
  bool wants_labels = false;                  // Perception::wants_labels()
};

enum class Pace : std::uint8_t { kLockstep, kRealTime };

class CameraCrew {
 public:
  // All must outlive it. In lockstep, collect() waits for a frame that is due; in real time a late frame is skipped
  // over.
  CameraCrew(const world::World& world, std::vector<body::Camera*> cameras, perception::Perception& perception,
             Pace pace);
  ~CameraCrew();
  CameraCrew(const CameraCrew&) = delete;
  CameraCrew& operator=(const CameraCrew&) = delete;

  // On the thread that advances the body, after each advance. A camera that reads labels skips its turn while nothing
  // that it could read is known to lie unread.
  void open_shutters(Time now, const body::Sensors& sensors);

  // On the bridge's thread: the newest snapshot that is due, if there is a new one. `forgotten` tracks are passed on to
  // perception before the next frame. Error: a camera failed.
  [[nodiscard]] Expected<std::optional<Snapshot>> collect(Time now, const std::vector<std::uint32_t>& forgotten);

 private:
  struct Shot {
    std::size_t camera = 0;
    Time stamp, due;
    perception::Moment moment;
    std::vector<std::uint32_t> forgotten;
  };

  void develop(const std::stop_token& stop);
  void perceive(const std::stop_token& stop);
  [[nodiscard]] Snapshot take_in(const Shot& shot);
  [[nodiscard]] Duration latency(std::size_t camera) const;

  const world::World& world_;
  std::vector<body::Camera*> cameras_;
  perception::Perception& perception_;
  Pace pace_;
  bool finds_ = false;              // what lies on the belt, some camera that reads no labels
  std::vector<Time> next_shutter_;  // a camera; the body's thread only
  std::vector<RgbdFrame> frames_;   // a camera; whose shot is developed or taken in

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<bool> busy_;                // a camera; from shutter until its frame is taken in
  std::deque<Shot> shots_;                // not yet taken in, by stamp
  std::size_t developed_ = 0;             // so many at the front of shots_
  std::deque<Snapshot> snapshots_;        // taken in, by stamp
  std::vector<std::uint32_t> to_forget_;  // not yet with a shot
  bool wants_labels_ = false;             // as of the newest snapshot collected
  std::optional<Error> error_;
  std::jthread developer_, perceiver_;
};

}  // namespace pons::runner
