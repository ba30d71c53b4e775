// Where and when the cups meet a parcel that rides on the belt.
#pragma once

#include "pons/skills/cell.hpp"

namespace pons::skills {

struct Grasp {
  motion::Trajectory trajectory;  // to the contact, then along with the belt
  Time hover;                     // over the parcel, coming down
  Time contact;
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();  // of the tip, world frame
  Vector3 contact_point = Vector3::Zero();                    // tip at `contact`, world frame
};

// Orientations are the tip's in the world frame.

// Of its x axis, rad; leaning changes that little.
[[nodiscard]] double yaw_of(const Eigen::Matrix3d& orientation);

// Along with the belt from `start`, with the tip over a point that moves on with it.
[[nodiscard]] Expected<motion::Trajectory> ride(Cell& cell, const AxisState& start, Time at,
                                                const Eigen::Matrix3d& orientation, double duration_s);

// The tip's joint speed for a Cartesian one.
[[nodiscard]] AxisVector joint_speed(Cell& cell, const AxisVector& q, const Vector3& tip_speed_m_s);

// Of the four orientations along the object's sides the one that turns the arm least from q: straight down, or along
// `lean` turned out of that.
[[nodiscard]] Expected<Eigen::Matrix3d> nearest_orientation(
    Cell& cell, const AxisVector& q, const Vector3& position, double object_yaw_rad,
    const Eigen::Quaterniond& lean = Eigen::Quaterniond::Identity());

// Over the parcel, about to come down, by a way that heeds nothing: no way round gets there sooner.
struct Meeting {
  double ahead_s = 0;  // after `at`
  Vector3 hover = Vector3::Zero();
  Eigen::Matrix3d orientation = Eigen::Matrix3d::Identity();
  AxisVector q;
};
[[nodiscard]] Expected<Meeting> meet_straight(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                                              const std::optional<Eigen::Matrix3d>& orientation);

// How a grasp is being found, while a tick is too short to find it; empty again when it has ended.
struct GraspSearch {
  double later_s = 0;         // than on the straight way: what is sooner was found blocked
  std::optional<Time> meets;  // over the parcel, by the last way that was found
  std::optional<Passage> known;
};

// The earliest grasp from `start` at `at`. With `orientation` given that grip is kept. Errors: out of reach, no clear
// way; while the router is spent, whoever asks with the same `search` in the next tick goes on from there.
[[nodiscard]] Expected<Grasp> plan_grasp(Cell& cell, const AxisState& start, Time at, const ObjectBelief& object,
                                         const std::optional<Eigen::Matrix3d>& orientation, GraspSearch& search);

// How the pick of one ends that may be another, or that waits upstream of the zone on a belt that waits for another:
// the arm is needed for that one. Nothing: it goes on.
[[nodiscard]] std::optional<task::Progress> better_left(const Cell& cell, const ObjectBelief& object);

// How the pick of one ends that this arm can take no more, or never could; nothing if it can.
[[nodiscard]] std::optional<task::Progress> never_taken(const world::World& world, const ObjectBelief& object);

// How the pick of one ends that is heavier than the rules allow.
[[nodiscard]] task::Progress overweight(double mass_kg);
// How it ends, or goes on, of one that is felt to pull so while it is lifted as no load does that may be sorted, or
// that pulls the arm off its way; nothing of all others. Lifted on, it would tear itself off the cups and throw the arm
// up.
[[nodiscard]] std::optional<task::Progress> never_lifted(const Cell& cell, double felt_kg);
// How the pick ends, or goes on, of one that is held after a stop has broken off its lift, and was weighed then;
// nothing if it is taken as it hangs.
[[nodiscard]] std::optional<task::Progress> not_as_it_hangs(const world::World& world, const Held& held);

// How a pick ends that the vacuum cannot do: who comes after this arm may.
[[nodiscard]] task::Progress too_weak(const world::World& world);
// How a pick ends whose parcel is not where it should be, or nowhere.
[[nodiscard]] task::Progress not_there(const Cell& cell, const std::string& code);
// What would come along with that object, or that it may be another, and why; nothing if it lies by itself.
[[nodiscard]] std::optional<std::string> tied_to(const Cell& cell, const ObjectBelief& object);

// As seen from the belt: high enough that its underside clears whatever stands close to it, and a little away from
// that. What touches a load would be dragged up by its flank.
[[nodiscard]] Vector3 lift_offset(const Cell& cell, const ObjectBelief& target);

// With a load on the cups: straight, by `offset` as seen from the belt, and on with the belt there; `peak_m_s2` is the
// largest acceleration beside what the start needs.
struct Lift {
  motion::Trajectory trajectory;  // ends at rest; whoever takes over does so before
  Time top;                       // when the offset is reached
  Time rides_until;               // the arm stays behind the belt from then on
};
[[nodiscard]] Expected<Lift> lift(Cell& cell, const AxisState& start, Time at, const Eigen::Matrix3d& orientation,
                                  const Vector3& offset, double peak_m_s2);

// What hangs on the cups that took the object so. One that leans stands on its lower edge, and is so much thinner than
// its middle is high.
[[nodiscard]] Load load_of(const ObjectBelief& object, const Eigen::Matrix3d& orientation);

// For one still too far upstream: to over where it will come within reach, higher than what passes below. Errors: out
// of reach; no way.
[[nodiscard]] Expected<motion::Trajectory> way_to_wait(Cell& cell, const ObjectBelief& object, const Grasp& grasp,
                                                       Time now);

// How often the cups of one grasp were pressed further onto what they touch, or brought deeper where they touch
// nothing.
struct Presses {
  int further = 0, deeper = 0;
};
// Too few cups have sealed: a little further down, riding along with the belt from `pressed` on. A parcel that lies
// askew meets some cups first; pressing on, the bellows give way and the others seal, too. What lay on another that is
// gone lies lower than it was seen. Error: as hard or often as may be, as deep as the belt, or out of reach.
struct PressedDown {
  motion::Trajectory trajectory;
  Time pressed;
};
[[nodiscard]] Expected<PressedDown> press_down(Cell& cell, Time now, const Eigen::Matrix3d& orientation,
                                               Presses& presses);

// How far the cups slide over what they touch. They ride along as fast as the belt ran when that was planned; it may
// start, stop or jam, or the arm be slowed: pressed on what drags them along, they push the arm aside.
class Slip {
 public:
  // Each period; `touches` from the contact on. True: further than the cups give way.
  [[nodiscard]] bool is_over(Cell& cell, bool touches);

 private:
  std::optional<double> met_at_m_;  // the commanded tip then, along the belt and relative to it
};

// What hangs on the cups, as if it were seen there.
[[nodiscard]] ObjectBelief held_at(const Held& held, const Pose& world_from_tip);

// A straight move of the tip by `offset`, ending at `tip_speed`, planned in joint space.
[[nodiscard]] Expected<motion::Trajectory> nudge(Cell& cell, const AxisState& start, Time at,
                                                 const Eigen::Matrix3d& orientation, const Vector3& offset,
                                                 const Vector3& tip_speed, const AxisLimits& limits);

}  // namespace pons::skills
