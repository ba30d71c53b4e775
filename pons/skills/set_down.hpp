// Lays what the cups hold on the belt, to ride into the exception chute: what cannot be placed must not stay held.
#pragma once

#include <optional>

#include "pons/skills/cell.hpp"

namespace pons::skills {

class SetDown {
 public:
  // `cell` must outlive it.
  explicit SetDown(Cell& cell) : cell_(cell), delay_(cell.arm) {}

  // Sets out for the first spot with room, from the middle of the pick zone on; something must be held. Error: no way
  // there now; what is in it rides on.
  [[nodiscard]] Expected<void> begin(Time now);
  // The way down is under way already, and ends then.
  void begin_at(Time released_at) {
    released_at_ = released_at;
    emptied_at_.reset();
    (void)delay_.take();
  }
  // Once a period after that: true when the cups are empty. Error: the arm does not obey.
  [[nodiscard]] Expected<bool> tick(Time now);

 private:
  [[nodiscard]] Expected<motion::Trajectory> way_to_belt(Time now, double over_belt_m);
  [[nodiscard]] Vector3 free_spot(Time time, double over_belt_m) const;

  Cell& cell_;
  Delay delay_;
  Cell::Search search_{.must = true};
  std::size_t height_ = 0;  // over the belt, that is being searched
  Time released_at_;
  std::optional<Time> emptied_at_;
};

}  // namespace pons::skills
