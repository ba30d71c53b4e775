// Seeded randomness whose numbers are the same with every compiler and library (std distributions are not).
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace pons {

// SplitMix64 (Steele, Lea, Flood 2014): small, and a stream per seed is enough here.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(seed) {}

  constexpr std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  // In [0, 1).
  constexpr double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }
  // In [low, high).
  constexpr double uniform(double low, double high) { return low + (high - low) * uniform(); }
  // In [0, count); count must be positive. The bias is below 2⁻⁵⁰ for the counts used here.
  constexpr std::uint64_t below(std::uint64_t count) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(count));
  }
  // Standard normal (Box and Muller 1958), one of the pair.
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }
  // An independent stream: the same seed and name give the same stream whatever else was drawn.
  [[nodiscard]] constexpr Random fork(std::uint64_t name) const {
    return Random(Random(state_ ^ (name * 0xd1342543de82ef95ULL)).next());
  }

 private:
  std::uint64_t state_;
};

}  // namespace pons
