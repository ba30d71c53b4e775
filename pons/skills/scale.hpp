// Weighs what hangs on the cups from the wrist's force and moment while the arm moves.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "pons/skills/cell.hpp"

namespace pons::skills {

struct Weight {
  double mass_kg = 0;                  // tool taken off
  Eigen::Vector2d beside_tip_m{0, 0};  // of its centre of mass, tip frame: how far from the tip's axis
};

inline constexpr double kLightest_kg = 0.01;  // of all loads: what weighs less is borne by something

// What hangs on a load besides, and whose weight it seems to be, by code.
struct Beside {
  std::string whose = "another";
};
// Felt, by how far beside the load's middle it hangs: near its edge or beyond, where no parcel is that uneven; or less
// far, towards one of its company; or, where another was found on it `before` and it is heavier still, at all, or is
// denser than parcels are. What was found so time and again and is no heavier now, or is far lighter than ever, and is
// not so far off its middle that no contents explain it, is uneven by itself: only the first of these counts then. But
// if it never comes off a companion with a code of its own, the two may be one, and no weight tells whose code is
// right: then one reading without it proves nothing, either.
[[nodiscard]] std::optional<Beside> hangs_beside(const Load& load, const Weight& weight, const Company& company,
                                                 const std::optional<Hooked>& before);

// What is known of a load by that code that is put back, for another hangs on it or may.
[[nodiscard]] Hooked hooked_again(const Held& held, double mass_kg, const std::optional<Beside>& beside,
                                  const std::optional<Hooked>& before);

// Whether a load that is felt to hang alone now may be the one that hung on it: it is as heavy as what was felt beside
// its middle the last time, and once both were heavier. Where no camera tells who is left, how high the cups took hold
// does, `top_m` above the belt at most: nothing stands lower than the least of its own sides.
[[nodiscard]] bool may_be_who_hung(double mass_kg, double top_m, const Hooked& before);
// That height of what hangs on the cups. Infinite: it is not known.
[[nodiscard]] double highest_top_m(const Cell& cell);

// That load as far as it reaches where a neighbour hid an end of it from the cameras: by itself it weighs at its
// middle.
[[nodiscard]] Load reaching(const Load& load, const Weight& weight);

// The load swings on its bellows, so no single force tells its mass; the impulse over a swing does:
// ∫F dt = m (g T + v(T) − v(0)), v being the tip's measured vertical speed. The moment about the tip, over all
// readings, tells where it hangs.
class Scale {
 public:
  // Call once a bridge tick while nothing supports the load.
  void add(Cell& cell);
  // Of the load over the latest readings; nothing until they span a swing and their halves agree: until then something
  // may still bear a part of it. A swing is that of `expected_kg`, or of what is felt where that is more.
  [[nodiscard]] std::optional<Weight> weigh(const Cell& cell, double expected_kg) const;

 private:
  struct Reading {
    double time_s, force_n, speed_m_s;
    Eigen::Vector2d moment_nm;  // about the tip, tip frame, across its axis
  };
  template <typename Value>
  [[nodiscard]] Value impulse(Value Reading::* felt, std::size_t first, std::size_t last) const;
  [[nodiscard]] double mass_kg(std::size_t first, std::size_t last) const;

  std::vector<Reading> readings_;
};

// One reading at standstill, kg, tool taken off.
[[nodiscard]] double weigh_now(Cell& cell);

}  // namespace pons::skills
