#include "pons/rt/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace pons::rt {

std::size_t Histogram::bucket(std::uint64_t ns) {
  if (ns < kSteps) return static_cast<std::size_t>(ns);
  const int top = static_cast<int>(std::bit_width(ns)) - 1;  // the octave
  const auto step = (ns >> (top - kStepBits)) - kSteps;
  return static_cast<std::size_t>((top - kStepBits + 1) * kSteps) + static_cast<std::size_t>(step);
}

std::uint64_t Histogram::upper_edge(std::size_t bucket) {
  if (bucket < kSteps) return bucket;
  const auto octave = bucket / kSteps - 1, step = bucket % kSteps;
  return ((kSteps + step + 1) << octave) - 1;
}

void Histogram::record(Duration value) PONS_NONBLOCKING {
  const Duration clamped(std::clamp<std::int64_t>(value.count(), 0, kLongest_ns));
  ++counts_[bucket(static_cast<std::uint64_t>(clamped.count()))];
  ++count_;
  sum_ns_ += static_cast<double>(clamped.count());
  min_ = std::min(min_, clamped);
  max_ = std::max(max_, clamped);
}

Duration Histogram::mean() const {
  return count_ ? Duration(std::llround(sum_ns_ / static_cast<double>(count_))) : Duration{0};
}

Duration Histogram::percentile(double percent) const {
  if (count_ == 0) return Duration{0};
  const double share = std::clamp(percent, 0.0, 100.0) / 100.0;
  const auto wanted =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_))));
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += counts_[i];
    if (seen >= wanted) return std::min(max_, Duration(static_cast<std::int64_t>(upper_edge(i))));
  }
  return max_;
}

std::uint64_t Histogram::count_above(Duration limit) const {
  const auto within = bucket(static_cast<std::uint64_t>(std::clamp<std::int64_t>(limit.count(), 0, kLongest_ns)));
  std::uint64_t above = 0;
  for (std::size_t i = within + 1; i < kBuckets; ++i) above += counts_[i];
  return above;
}

void Histogram::add(const Histogram& other) {
  for (std::size_t i = 0; i < kBuckets; ++i) counts_[i] += other.counts_[i];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  min_ = std::min(min_, other.min_);
  max_ = std::max(max_, other.max_);
}

}  // namespace pons::rt
