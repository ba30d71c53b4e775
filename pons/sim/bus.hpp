// Set-points between their sending and their acting: what the bus and the drives of a real robot take.
#pragma once

#include <array>
#include <cstddef>

#include "pons/body/body.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons::sim {

// A fixed ring, in the order of sending. One thread.
class Bus {
 public:
  struct Told {
    body::SetPoints set_points;
    Time acts;
  };

  explicit Bus(Duration delay) : delay_(delay) {}
  [[nodiscard]] Duration delay() const { return delay_; }
  // More than kCapacity on their way: the oldest is lost.
  void send(const body::SetPoints& set_points, Time now) PONS_NONBLOCKING {
    if (count_ == kCapacity) drop_oldest();
    ring_[(first_ + count_++) % kCapacity] = {set_points, now + delay_};
  }
  // The next one that acts before `time`; null: none.
  [[nodiscard]] const Told* next(Time time) const {
    return count_ > 0 && ring_[first_].acts < time ? &ring_[first_] : nullptr;
  }
  void drop_oldest() PONS_NONBLOCKING {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }

 private:
  static constexpr std::size_t kCapacity = 32;  // more than a millisecond's each of the longest delay there is
  Duration delay_;
  std::array<Told, kCapacity> ring_{};
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace pons::sim
