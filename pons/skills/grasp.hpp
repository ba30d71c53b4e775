// Where and when the cups meet a parcel that rides on the belt.
#pragma once

#include "pons/skills/cell.hpp"

namespace pons::skills {

struct Grasp {
  motion::Trajectory trajectory;  // to the contact, then along with the belt
  Time hover;                     // over the parcel, coming down
  Time contact;
  double yaw_rad = 0;                       // of the tip, world frame
  Vector3 contact_point = Vector3::Zero();  // tip at `contact`, world frame
};

// Along with the belt from `start`, with the tip over a point that moves on with it.
[[nodiscard]] Expected<motion::Trajectory> ride(Cell& cell, const AxisState& start, Time at, double yaw_rad,
                                                double duration_s);

// The tip's joint speed for a Cartesian one.
[[nodiscard]] AxisVector joint_speed(Cell& cell, const AxisVector& q, const Vector3& tip_speed_m_s);

// The tip yaw, one of the object's four, that turns the arm least from q.
[[nodiscard]] Expected<double> nearest_yaw(Cell& cell, const AxisVector& q, const Vector3& position,
                                           double object_yaw_rad);

// The earliest grasp from `start` at `at`. With `yaw_rad` given that grip is kept. Errors: out of reach, no clear way.
[[nodiscard]] Expected<Grasp> plan_grasp(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                                         std::optional<double> yaw_rad);

// Straight up with a load on the cups, riding along with the belt, so that neighbours stay where they are.
struct Lift {
  motion::Trajectory trajectory;  // goes on with the belt above the top, as far as the arm reaches, and ends at rest
  Time top;                       // when the height is reached
};
[[nodiscard]] Expected<Lift> lift(Cell& cell, const AxisState& start, Time at, double yaw_rad, double height_m);

// A straight move of the tip by `offset`, ending at `tip_speed`, planned in joint space.
[[nodiscard]] Expected<motion::Trajectory> nudge(Cell& cell, const AxisState& start, Time at, double yaw_rad,
                                                 const Vector3& offset, const Vector3& tip_speed,
                                                 const AxisLimits& limits);

}  // namespace pons::skills
