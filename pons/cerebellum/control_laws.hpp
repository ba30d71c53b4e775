// By which law the arm follows its commanded motion, what the laws remember, and the change from one to another without
// a jump in torque.
#pragma once

#include <cstdint>

#include "pons/cerebellum/compliance.hpp"
#include "pons/cerebellum/computed_torque.hpp"
#include "pons/cerebellum/delay_line.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/link/message.hpp"

namespace pons::cerebellum {

struct ControlSettings {
  ComplianceLimits compliance;
  double fade_s = 0.08;  // in which what the torques would have jumped by fades away
  double bias_s = 0.5;   // time constant of the wrist sensor's bias
};

// Axes in rad, rad/s, rad/s², N·m. The loop's thread.
class ControlLaws {
 public:
  // What it asks of the drives acts `delay` ticks later. The model must outlive it.
  ControlLaws(model::RobotModel& model, const Gains& gains, const ControlSettings& settings, std::size_t delay);

  // From the next torques() on. Changing the law keeps torques continuous. Parameters must have no fault().
  void select(link::Controller controller, const link::Compliance& compliance) PONS_NONBLOCKING;
  // Tracking, from the next torques() on.
  void reset() PONS_NONBLOCKING;
  // What computed torque has corrected so far counts no longer: the arm is elsewhere, or had no power.
  void forget() PONS_NONBLOCKING { corrections_.forget(); }
  // The arm stands in what it corrects for, as in what pushes it: as much as pushes it off by `error_rad` is borne on,
  // wherever it is told to be.
  void bear(double error_rad) PONS_NONBLOCKING { corrections_.bear(gains_stopped_.position_1_s2 * error_rad); }
  [[nodiscard]] link::Controller controller() const { return controller_; }
  // Where the arm is held while it is commanded to be at `commanded`: where tracking goes on from when the law changes.
  [[nodiscard]] AxisVector held(const AxisVector& commanded, const AxisVector& measured) const PONS_NONBLOCKING;
  // What the arm was asked to do by now, as of the last tick: what was commanded so much earlier as the drives delay
  // it, with what admittance gave way.
  [[nodiscard]] const AxisState& acting() const { return asked_.out(); }
  // The newest of these.
  [[nodiscard]] const AxisState& asked() const { return asked_.before(0); }
  // What the commanded motion may have of the speed that is allowed: giving way adds to it.
  [[nodiscard]] double motion_share() const {
    return controller_ == link::Controller::kTracking ? 1 : 1 - kGivingShare;
  }
  // The arm rests where `commanded` has it; what is on its way no longer counts.
  void rest(const AxisState& commanded) PONS_NONBLOCKING { asked_.fill(commanded); }
  // Likewise, and comes there at its speed, a tick's way in each `period_s`.
  void come(const AxisState& commanded, double period_s) PONS_NONBLOCKING;

  // What is commanded: a motion, or the place where the arm was stopped.
  enum class Commanded : std::uint8_t { kMotion, kStopped };
  // What the arm does at this tick.
  struct Now {
    ArmNow arm;
    const AxisState& commanded;  // for when these torques will act
    const Vector6& felt;         // WristSense::at_tip()
    double dt_s;
    const AxisLimits& limits;
    double speed_share;  // that is allowed of each speed limit
    Commanded kind = Commanded::kMotion;
  };
  // Not clamped. `last_nm` are the torques of the tick before.
  void torques(const Now& now, const AxisVector& last_nm, AxisVector& torque_nm) PONS_NONBLOCKING;
  // Instead of torques(): without a measurement; and giving way to what pushes.
  void blind(const Now& now, AxisVector& torque_nm) PONS_NONBLOCKING;
  void yield(const Now& now, AxisVector& torque_nm) PONS_NONBLOCKING;

 private:
  model::RobotModel& model_;
  const Gains gains_, gains_stopped_;
  const ControlSettings settings_;
  link::Controller controller_ = link::Controller::kTracking;
  link::Compliance compliance_;
  Corrections corrections_;
  Admittance admittance_;
  AxisState reference_;
  DelayLine<AxisState> asked_;
  bool changed_ = false;
  AxisVector fading_nm_;  // what keeps the torques continuous after a change
};

}  // namespace pons::cerebellum
