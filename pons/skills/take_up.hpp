// What the arm's skills must know when a bridge follows one that is no more: what hangs on the cups, and whether a task
// that was begun can go on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pons/skills/cell.hpp"
#include "pons/task/task.hpp"

namespace pons::skills {

class TakeUp {
 public:
  // `cell` must outlive it.
  explicit TakeUp(Cell& cell) : cell_(cell) {}

  // What is on the cups, to be written down whenever it changes: {"code":…,"mass_kg":…,"size_m":[…],"yaw_rad":…,
  // "offset_m":[…],"alone":…,"doubtful":…,"falls":[…],"from_m":[…]}, as in Held; null when nothing is. Valid until the
  // next call.
  [[nodiscard]] const task::Json& carries();

  // After refresh(): believes what was written last, as far as the cups still hold something. What only the bridge that
  // wrote it had seen, beyond the cameras' view, is an obstacle from now on.
  void restore(const task::Json& carried);

  enum class Fate : std::uint8_t {
    kGoesOn,  // what the next step needs is at hand; or it is to find out what became of that
    kDone,    // the next step had done its work: the load has fallen into its place
    kAstray,  // it was carried, and has fallen into the chute fell_into(), which is not its place
    kLost,    // it was carried, and is no more
    kBroken,  // it was in the middle of something that cannot be gone on with; nothing is held
  };
  // Of a task whose first `done` steps have succeeded, after restore().
  [[nodiscard]] Fate fate(const task::Task& task, std::size_t done) const;
  // By the light curtains, since it was written down; empty: into none, or nothing was carried.
  [[nodiscard]] std::string fell_into() const;

  // Each tick once the arm is armed again, until it is true: only then may anything else move it. Lets go of what the
  // cups hold and nobody knows. An arm that stands low over the belt goes straight up first, for this bridge has not
  // seen yet what stands beside the load, and under the arm no camera does; with the cups empty it then steps aside.
  // Then the cameras have looked.
  [[nodiscard]] bool settle(Time now);

 private:
  [[nodiscard]] task::Json written(const Held& held) const;
  [[nodiscard]] Falls falls_from(const task::Json& carried) const;
  [[nodiscard]] std::vector<const world::Place*> fallen_into() const;
  [[nodiscard]] bool is_over(const std::string& place) const;
  [[nodiscard]] bool is_over_belt() const;
  [[nodiscard]] double too_low_m() const;
  [[nodiscard]] double load_height_m() const;
  [[nodiscard]] bool rise(Time now, double by_m);
  void hide_below();

  Cell& cell_;
  std::optional<Held> told_;  // of which carries_ tells, which need not be made anew each tick
  bool told_gone_ = false;
  task::Json carries_;
  std::string carried_;  // the code that was written down, whether still held or not
  std::optional<Time> called_;
  Time looks_until_;
  int rises_ = 0, steps_ = 0;
  bool aside_ = false;
};

}  // namespace pons::skills
