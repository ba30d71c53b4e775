#include "apps/memory.hpp"

#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>

namespace pons::apps {
namespace {

constexpr std::int64_t kFrom = 500;  // parcels: what fills by then is not what leaks
constexpr double kMib = 1 << 20;
constexpr int kLargeBlock = 512 << 10;

}  // namespace

void keep_large_blocks_off_the_heap() { mallopt(M_MMAP_THRESHOLD, kLargeBlock); }

void HeapTrimmer::tick(Time now) {
  if (now < next_) return;
  next_ = now + kEvery;
  malloc_trim(0);
}

double own_mib() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0, shared = 0;  // pages
  if (!(file >> size >> resident >> shared)) return std::numeric_limits<double>::quiet_NaN();
  return (resident - shared) * static_cast<double>(sysconf(_SC_PAGESIZE)) / kMib;
}

void MemoryWatch::settled(std::int64_t parcels) {
  if (parcels < kFrom || parcels <= settled_) return;
  settled_ = parcels;
  const double now_mib = read_();
  if (std::isnan(seen_.at_500_mib)) seen_.at_500_mib = now_mib;
  // Of a number and NaN these take the number.
  seen_.least_mib = std::fmin(seen_.least_mib, now_mib);
  seen_.most_mib = std::fmax(seen_.most_mib, now_mib);
}

record::Report::Memory MemoryWatch::end() const {
  record::Report::Memory memory = seen_;
  memory.end_mib = read_();
  return memory;
}

}  // namespace pons::apps
