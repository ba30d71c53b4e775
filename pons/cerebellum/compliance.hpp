// The two compliant laws, as pure functions of model, states and parameters; what they remember is handed in and out.
#pragma once

#include <limits>
#include <string_view>

#include "pons/cerebellum/arm_now.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/link/message.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// Bounds of what a kControl may ask for.
struct ComplianceLimits {
  double stiffness_n_m = 5000, stiffness_nm_rad = 300;
  double damping_ns_m = 5000, damping_nms_rad = 300;  // and above 0
  double force_n = 200;                               // of Compliance::force_max_n, above 0, and of the wrench
  double lever_m = 0.15;                              // a moment counts as a force so far from the tip
  // All dampers of an impedance are scaled down where they would brake some motion of the tip faster than that.
  double fastest_1_s = std::numeric_limits<double>::infinity();
};

// With drives that act so much later: faster dampers would push instead of brake.
[[nodiscard]] ComplianceLimits with_delay(ComplianceLimits limits, double delay_s);

// What is wrong with it; empty when nothing.
[[nodiscard]] std::string_view fault(const link::Compliance& compliance,
                                     const ComplianceLimits& limits) PONS_NONBLOCKING;

// Cartesian impedance without shaping the inertia (Hogan 1985; Ott 2008): torques
//   ID(q, q̇, q̈_c) + Jᵀ f + null-space posture,   f = K e + D ė + w, bounded by force_max_n,
// with e from the tip to where the commanded state has it, in the commanded tip's axes. At rest the tip yields w/K or
// f/K exactly, whatever the arm's inertia. Of seven axes, the one motion that leaves the tip where it is follows the
// commanded posture, decoupled by inertia (Khatib 1987). Weight, tool and payload are compensated.
void impedance(model::RobotModel& model, const link::Compliance& compliance, const ComplianceLimits& limits,
               const ArmNow& arm, const AxisState& commanded, AxisVector& torque_nm) PONS_NONBLOCKING;

// What admittance remembers: how far the tip has given way.
struct Admittance {
  Vector6 speed = Vector6::Zero();  // m/s, rad/s, the commanded tip's axes
  Vector6 way = Vector6::Zero();    // m, rad: likewise
  AxisVector axis_way, axis_speed;  // rad and rad/s, of each axis
};

// What giving way may use up.
struct Room {
  const AxisLimits& limits;
  double speed_share = 1;  // that is allowed of each speed limit, commanded motion included
};

// One tick of M ẍ = w_felt + w - D ẋ - K x (Hogan 1985), semi-implicitly, so that any damping is stable: `felt` is what
// the surroundings exert on the tip (tip axes). `reference` becomes the commanded state and the way of the axes that
// gives the tip that way, no faster than kAdmittanceSpeed, kGivingShare of each axis' speed, and what the commanded
// motion leaves of speed and acceleration limits: acceleration first, where that leaves less speed than before.
// Position limits hold. Jerk is not bounded: a push comes as it comes.
void admittance(model::RobotModel& model, const link::Compliance& compliance, const ComplianceLimits& limits,
                const Room& room, const AxisState& commanded, const Vector6& felt, double dt_s, Admittance& state,
                AxisState& reference) PONS_NONBLOCKING;

inline constexpr double kGivingShare = 0.25;
inline constexpr double kAdmittanceSpeed_m_s = 0.10, kAdmittanceSpeed_rad_s = 0.5;
inline constexpr double kAdmittanceMass_kg = 4, kAdmittanceInertia_kg_m2 = 0.1;

}  // namespace pons::cerebellum
