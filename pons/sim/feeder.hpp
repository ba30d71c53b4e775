// The plant upstream: the belt's wandering speed, and parcels put on it on demand. Private to pons/sim.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "pons/core/time.hpp"
#include "pons/sim/arrivals.hpp"
#include "pons/sim/compose.hpp"
#include "pons/sim/ledger.hpp"
#include "pons/sim/renderer.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

// A belt whose speed wanders smoothly within ± speed_variation of the nominal one while it is let run, and which starts
// and stops along a ramp.
class BeltDrive {
 public:
  BeltDrive(const world::Belt& belt, std::uint64_t seed);
  void let_run() { wanted_ = 1; }
  void stop() { wanted_ = 0; }
  // Sets the surface's speed for the coming step and counts the travel.
  void step(mjModel* model, int geom, Time now, double step_s);
  [[nodiscard]] double speed_m_s() const { return speed_m_s_; }
  [[nodiscard]] double travel_m() const { return travel_m_; }

 private:
  world::Belt belt_;
  std::array<double, 3> phase_{};
  double wanted_ = 0, share_ = 0;  // of the speed that it would have if it always ran
  double speed_m_s_ = 0, travel_m_ = 0;
};

// Keeps arrivals.waiting parcels on the belt ahead of the pick zone's end, group by group, each as soon as there is
// room at the belt's start.
class Feeder {
 public:
  Feeder(const world::World& world, const world::Manifest& manifest, std::vector<Arrival> arrivals);
  // Parks what has left, puts down what is due.
  void step(const Composed& cell, mjModel* model, mjData* data, Ledger& ledger, LabelStore& labels,
            const BeltDrive& belt, Time now);
  [[nodiscard]] int offered() const { return static_cast<int>(next_); }
  // Whether a beam across the belt's entry, 8 mm above it, meets a parcel.
  [[nodiscard]] bool photo_eye(const Composed& cell, const mjData* data, const Ledger& ledger) const;

 private:
  // Where the front of a group of that length is put down.
  [[nodiscard]] double front_m(double length_m) const;
  [[nodiscard]] bool room(const Composed& cell, const mjData* data, const Ledger& ledger, double length_m) const;
  [[nodiscard]] int waiting(const Composed& cell, const mjData* data, const Ledger& ledger) const;
  [[nodiscard]] std::size_t group_size() const;
  [[nodiscard]] bool wanted(int waiting) const;
  void put_down(const Composed& cell, mjModel* model, mjData* data, Ledger& ledger, LabelStore& labels,
                double speed_m_s, Time now);

  world::World world_;
  world::Manifest manifest_;
  std::vector<Arrival> arrivals_;
  double hidden_end_m_;  // upstream of it no camera sees the belt
  std::size_t next_ = 0;
  double last_travel_m_ = -1e9;  // belt travel when the last group was put down
  double last_gap_m_ = 0;
  double last_rear_m_ = 0;  // where its rear was then
};

}  // namespace pons::sim
