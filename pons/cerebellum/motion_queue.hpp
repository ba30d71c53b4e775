// The motion asked of the arm and not yet done: a fixed ring of segments, each continuing the one before.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/segment.hpp"
#include "pons/core/time.hpp"

namespace pons::cerebellum {

// How far two neighbours may differ at their seam; an end with less speed and acceleration than this is at rest.
struct SeamTolerance {
  static constexpr double kPosition = 1e-6;      // rad
  static constexpr double kSpeed = 1e-5;         // rad/s
  static constexpr double kAcceleration = 1e-3;  // rad/s²
  static constexpr Duration kTime{1'000};        // gap or overlap in time
};

enum class Refusal : std::uint8_t { kNone, kNotFinite, kFromThePast, kGap, kDiscontinuous, kFull };
[[nodiscard]] std::string_view name(Refusal refusal);

enum class Phase : std::uint8_t {
  kResting,     // nothing to follow now; the state holds still
  kFollowing,   // the state is of a segment
  kEndedMoving  // the motion ended with speed or acceleration, and nothing follows; the state is its end
};

// Constant time a call but for splices, which look at the queue once. Allocates nothing. One thread.
class MotionQueue {
 public:
  static constexpr std::size_t kCapacity = 256;

  // Forgets all motion; rests at `position` from `time` on.
  void rest(const AxisVector& position, Time time) PONS_NONBLOCKING;

  // Appends a segment; with `splice` first drops what is queued from its start on. `sampled` is the last time that was
  // commanded: nothing may begin before. A refused segment leaves the queue useless: rest() it.
  [[nodiscard]] Refusal append(const Segment& segment, bool splice, Time sampled) PONS_NONBLOCKING;

  // The motion at `time`, which must not go backwards from call to call. Drops what has ended.
  [[nodiscard]] Phase sample(Time time, AxisState& state) PONS_NONBLOCKING;

  // The same at any time not before the last sample(), and nothing is dropped. `hint` is of the call before, on the
  // same queue and for an earlier time, or 0.
  Phase peek(Time time, std::size_t& hint, AxisState& state) const PONS_NONBLOCKING;
  // The largest share of its axis' speed limit that the motion from `from` on has. Exact for constant jerk, else to
  // within what it changes in an eighth of a segment.
  [[nodiscard]] double fastest(Time from, const AxisVector& speed_limits) const PONS_NONBLOCKING;

  // When the queued motion ends, or the last one ended.
  [[nodiscard]] Time end() const PONS_NONBLOCKING;
  [[nodiscard]] std::size_t size() const PONS_NONBLOCKING { return count_; }

 private:
  [[nodiscard]] Segment& at(std::size_t i) { return segments_[(first_ + i) % kCapacity]; }
  [[nodiscard]] const Segment& at(std::size_t i) const { return segments_[(first_ + i) % kCapacity]; }
  void pop() {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }
  void cut_from(Time start);
  [[nodiscard]] Refusal check_seam(const Segment& segment, Time sampled) const;

  std::array<Segment, kCapacity> segments_{};
  std::size_t first_ = 0, count_ = 0;
  AxisVector rest_;  // where it rests before the first segment
  Time rests_since_;
};

// Speed and acceleration within the seam tolerances.
[[nodiscard]] bool is_at_rest(const AxisState& state) PONS_NONBLOCKING;

}  // namespace pons::cerebellum
