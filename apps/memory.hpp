// How much memory this process has taken for itself, and how that goes in the course of a run.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include "pons/core/time.hpp"
#include "pons/record/report.hpp"

namespace pons::apps {

// Pictures and what is made of them, of a size of half a megabyte and more, come and go by the thousand. The more such
// blocks are freed, the larger are those that glibc puts on the heap, where they leave holes that grow for hours. From
// now on each has pages of its own, which go back when it goes. What it costs: docs/figures.md.
void keep_large_blocks_off_the_heap();

// Smaller ones leave holes, too, of which glibc gives back only what lies at a heap's end. One thread at a time.
class HeapTrimmer {
 public:
  static constexpr Duration kEvery = std::chrono::seconds(10);

  // So often, in a run's time, gives the pages of all holes back: that takes less than a millisecond.
  void tick(Time now);

 private:
  Time next_{kEvery};
};

// MiB resident, but for what files back: the kernel drops pages of programs and libraries when it likes, and gets them
// again. NaN where it does not say.
[[nodiscard]] double own_mib();

// One thread at a time.
class MemoryWatch {
 public:
  explicit MemoryWatch(std::function<double()> read = own_mib) : read_(std::move(read)) {}

  // So many parcels are settled by now. Reads once for each more, from the 500th on.
  void settled(std::int64_t parcels);
  // The run has ended.
  [[nodiscard]] record::Report::Memory end() const;

 private:
  std::function<double()> read_;
  record::Report::Memory seen_;
  std::int64_t settled_ = 0;
};

}  // namespace pons::apps
