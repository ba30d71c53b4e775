// Lays what the cups hold on the belt, to ride into the exception chute: what cannot be placed must not stay held.
#pragma once

#include <optional>

#include "pons/skills/cell.hpp"

namespace pons::skills {

// Over where it was lifted from, when it is let go of: on stretched bellows it hangs up to 12 mm lower.
inline constexpr double kPutBack_m = 0.02;

class SetDown {
 public:
  // `cell` must outlive it.
  explicit SetDown(Cell& cell) : cell_(cell), delay_(cell.arm) {}

  // Sets out for the first spot with room, from the middle of the pick zone on; something must be held. What may not
  // hang alone goes back to where it was lifted from, if that is within reach: who hangs on it may be larger than the
  // room. Error: no way there now; what is in it rides on.
  [[nodiscard]] Expected<void> begin(Time now);
  // Sets out for a place on the belt beside others: to over it first, and straight down from there; what is heavy not
  // before the belt, which has to be held, and it have come to rest. `tip_m`: where the
  // tip is to be, relative to the belt (world x less its travel). `top_z_m`: where its top will be, world, if that is
  // known: it may lie on another. Error: out of reach.
  [[nodiscard]] Expected<void> begin_back(Time now, const Vector3& tip_m, const Eigen::Matrix3d& orientation,
                                          std::optional<double> top_z_m = {});
  // Where it hangs, at once. `top_z_m`: likewise.
  void begin_here(Time now, double top_z_m);
  // Once a period after that: true when the cups are empty, and off what they pressed on. Error: the arm does not obey,
  // or down is out of reach.
  [[nodiscard]] Expected<bool> tick(Time now);

 private:
  [[nodiscard]] bool goes_back(Time now);
  // To over the place if it is not there yet, else down.
  [[nodiscard]] Expected<void> go_back(Time now);
  void begin_at(Time released_at);
  // What it let go of pushes the arm back, and it rises off that now.
  [[nodiscard]] bool comes_free(Time now);
  [[nodiscard]] bool heavy() const { return cell_.held->mass_kg > cell_.world.rules.max_mass_kg; }
  [[nodiscard]] Expected<motion::Trajectory> way_to_belt(Time now, double over_belt_m);
  [[nodiscard]] Vector3 free_spot(Time time, double over_belt_m) const;

  Cell& cell_;
  Delay delay_;
  Cell::Search search_{.must = true};
  std::size_t height_ = 0;  // over the belt, that is being searched
  // Where there will be room depends on when it gets there, and that on where.
  int round_ = 0;
  Time arrives_;
  struct Back {
    Vector3 tip_m;  // relative to the belt
    Eigen::Matrix3d orientation;
    bool over = false;  // it, when the present way ends; the way down is found only then
  };
  std::optional<Back> back_;
  std::optional<double> top_z_m_;
  bool beside_others_ = false;  // which may lie under it; elsewhere it would not stay on what it met
  Time released_at_;
  std::optional<Time> free_at_;  // the cups are empty; the arm no longer springs up, or rises, from then on
  bool rises_ = false;
};

}  // namespace pons::skills
