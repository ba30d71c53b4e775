// What falls into the mouths of one arm's chutes, as their light curtains count it: what of that nobody let go of, and
// what was let go of and is not counted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/time.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// How often something fell into each of the world's places.
using Falls = std::array<std::uint16_t, kMaxPlaces>;

// One thread.
class Mouths {
 public:
  // `world` must outlive it.
  explicit Mouths(const world::World& world) : world_(world) {}

  struct Load {
    std::string code;
    Time let_go;
  };

  // A load is let go of over that place, or has been lost on its way and may fall anywhere.
  void expect_at(std::string_view place, const std::string& code, Time now);
  void expect_anywhere(Time now) { anywhere_ = now; }
  // What was lost is no longer waited for: if it falls now, nobody else tells of it.
  void expect_no_more() { anywhere_.reset(); }
  // Each tick: the places into which something fell since the last one that was not expected, or rode.
  [[nodiscard]] std::vector<const world::Place*> unexpected(const Falls& falls, Time now);
  // The chutes into which something has fallen since it was so, the last one last. What rides off the belt's end breaks
  // no chute's.
  [[nodiscard]] std::vector<const world::Place*> fallen_since(const Falls& before) const;
  // After that: the loads that should have fallen into their places by now, each once.
  [[nodiscard]] std::vector<Load> take_uncounted(Time now);

 private:
  [[nodiscard]] bool was_expected(std::size_t place, Time now);

  const world::World& world_;
  std::optional<Falls> last_;
  std::array<std::optional<Load>, kMaxPlaces> expected_{};
  std::array<Time, kMaxPlaces> counted_{};
  std::optional<Time> anywhere_;
};

}  // namespace pons::skills
