// A way for a base over its floor: the cheapest one on the map's cells, pulled straight.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/skills/base/floor.hpp"

namespace pons::skills {

// From where the base is to where it shall be, along straight lines. Never empty.
using Way = std::vector<Vector2>;

// A* over the cells (Hart, Nilsson, Raphael 1968), eight neighbours each; what lies close by makes a cell dearer. A
// search may be longer than a tick: it goes on where it stopped. The floor must not change meanwhile; should it, begin
// anew.
class WaySearch {
 public:
  WaySearch(const Floor& floor, const Vector2& from, const Vector2& to);

  // Looks at so many cells more. Nothing: it is not done. Error: there is no way, and what it is that stands in it.
  [[nodiscard]] std::optional<Expected<Way>> go_on(int cells);
  [[nodiscard]] std::uint64_t version() const { return version_; }  // the floor's when it began

 private:
  struct Open {
    float bound, cost;  // the least that a way through there can cost, and what it costs to there
    std::int32_t cell;
    bool operator<(const Open& other) const { return bound > other.bound; }  // the cheapest first
  };
  [[nodiscard]] std::optional<std::int32_t> cell_near(const Vector2& at) const;
  void look_round(const Open& at);
  [[nodiscard]] Way pulled_straight() const;
  [[nodiscard]] Error blocked() const;

  const Floor& floor_;
  Vector2 from_, to_;
  std::uint64_t version_;
  std::optional<std::int32_t> first_, goal_;
  std::vector<float> cost_;
  std::vector<std::int32_t> before_;
  std::vector<Open> open_;  // a heap
};

// From `here` to the nearest point of the way, and from there along it to its end, m.
[[nodiscard]] double left_along(const Way& way, const Vector2& here);

// The least room that the base has along the line.
[[nodiscard]] double clearance_along(const Floor& floor, const Vector2& from, const Vector2& to);

}  // namespace pons::skills
