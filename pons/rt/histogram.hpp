// How long things took, without allocation: counts by size, fine enough for percentiles, exact at the ends.
#pragma once

#include <array>
#include <cstdint>

#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons::rt {

// Log-linear: exact below 64 ns, then 64 steps an octave (1.6 %), up to 68 s; longer counts as 68 s, negative as 0.
// Nothing is filtered. One writer; read it when the writer is done, or hand over a copy.
class Histogram {
 public:
  void record(Duration value) PONS_NONBLOCKING;

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] Duration min() const { return count_ ? min_ : Duration{0}; }
  [[nodiscard]] Duration max() const { return max_; }
  [[nodiscard]] Duration mean() const;
  // The smallest recorded step that `percent` (0…100) of all values do not exceed: its upper edge, at most max(). 0
  // when empty.
  [[nodiscard]] Duration percentile(double percent) const;
  // How many values were above `limit`; one within its step (1.6 %) counts as not above.
  [[nodiscard]] std::uint64_t count_above(Duration limit) const;
  void add(const Histogram& other);

 private:
  static constexpr int kStepBits = 6, kSteps = 1 << kStepBits, kTopBit = 36;
  static constexpr std::size_t kBuckets = static_cast<std::size_t>((kTopBit - kStepBits + 1) * kSteps);
  static constexpr std::int64_t kLongest_ns = (std::int64_t{1} << kTopBit) - 1;
  static std::size_t bucket(std::uint64_t ns);
  static std::uint64_t upper_edge(std::size_t bucket);

  std::array<std::uint64_t, kBuckets> counts_{};
  std::uint64_t count_ = 0;
  double sum_ns_ = 0;
  Duration min_{Duration::max()}, max_{0};
};

}  // namespace pons::rt
