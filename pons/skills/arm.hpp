// The bridge's hand on the arm: streams motion and vacuum through the link and remembers what it asked for, so that the
// next motion can start in the middle of the last one without a seam. One thread, the bridge's.
#pragma once

#include <cstdint>

#include "pons/core/error.hpp"
#include "pons/link/link.hpp"
#include "pons/motion/motion.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// From the moment a motion is planned to its begin: two bridge periods, one for the command to arrive, one in reserve.
inline constexpr Duration kSpliceLead = std::chrono::milliseconds(20);

class Arm {
 public:
  // Both must outlive it. A motion that arrives after its begin is refused and stops the arm, so where ticks may come
  // late `splice_lead` must be longer than they do.
  Arm(link::BridgeEnd& link, const world::World& world, Duration splice_lead = kSpliceLead);

  // Once a bridge tick, before any skill: takes in the newest state and shows the cerebellum that the bridge lives.
  void refresh(Time now);

  [[nodiscard]] const link::State& state() const { return state_; }
  [[nodiscard]] bool operational() const { return state_.safety == link::SafetyState::kOperational; }

  // Where the motion asked for so far will be at `time`.
  [[nodiscard]] AxisState planned(Time time) const;
  [[nodiscard]] Time motion_end() const;
  // The earliest moment from which a motion may be replaced: the link and the loop need some ticks.
  [[nodiscard]] Time splice_time(Time now) const { return now + splice_lead_; }
  // The earliest one at which the motion under way already keeps `limits`: a heavy load must not inherit the haste of
  // what came before.
  [[nodiscard]] Time splice_time(Time now, const AxisLimits& limits) const;

  // Replaces what was asked for from trajectory.front().start on. Error: the link is full.
  [[nodiscard]] Expected<void> stream(const motion::Trajectory& trajectory);
  // From the splice time to standstill along the limits.
  [[nodiscard]] Expected<void> stop(Time now);

  void vacuum(bool on);
  void payload(double mass_kg, const Vector3& com_in_flange_m);
  // From now on the tip may meet this force (N) without its being taken for a collision; until told otherwise, also
  // when the arm is armed again.
  void expect_contact(double force_n);
  // By which law the arm follows from now on; it must rest. Parameters: see cerebellum's fault().
  void control(link::Controller controller, const link::Compliance& compliance = {});
  [[nodiscard]] const link::Vacuum& cups() const { return state_.vacuum; }

  // Leaves a stop (when it may) and arms from standstill. Moves nothing.
  void arm(Time now);

 private:
  bool send(link::Command command);

  link::BridgeEnd& link_;
  const world::World& world_;
  Duration splice_lead_;
  link::State state_;
  motion::Trajectory asked_;
  AxisState rest_;  // in force when nothing was asked for since arming
  std::uint64_t sequence_ = 0;
  double contact_n_ = 0;
  link::Controller was_controlled_ = link::Controller::kTracking;
  bool was_operational_ = false;
};

}  // namespace pons::skills
