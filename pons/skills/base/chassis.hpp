// What all base skills share: the wheels, where the base is, and the floor around it. One object a bridge, one thread.
#pragma once

#include <deque>
#include <optional>

#include "pons/core/belief.hpp"
#include "pons/model/diff_drive.hpp"
#include "pons/skills/arm.hpp"
#include "pons/skills/base/floor.hpp"
#include "pons/skills/base/odometry.hpp"
#include "pons/skills/base/steer.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

class Chassis {
 public:
  // `link` and `world` must outlive it; the world has a base. `splice_lead`: see Arm.
  Chassis(link::BridgeEnd& link, const world::World& world, Duration splice_lead = kSpliceLead);

  // Once a bridge tick, before any skill: the newest state of the wheels; odometry carries the pose on.
  void refresh(Time now);
  // What the newest scan said, which is some time old by now.
  void locate(const BaseBelief& belief);

  // As of the newest scan; nothing before the first.
  [[nodiscard]] const std::optional<BaseBelief>& belief() const { return belief_; }
  // Whether there was a scan lately, as of the last refresh. Without any the lidar is broken, covered or not there yet.
  [[nodiscard]] bool sees() const;
  // Whether it knows where it is, and what is around, well enough to drive.
  [[nodiscard]] bool sure() const;
  // Where it is as of the last refresh: the belief, carried on by what the wheels have turned since.
  [[nodiscard]] const Pose2& map_from_base() const { return map_from_base_; }
  // What the wheels alone say of it, as of the last refresh.
  [[nodiscard]] const Odometry& odometry() const { return odometry_; }

  // Where the skill that drives now is going to; nothing: none is.
  struct Heading {
    Pose2 goal;
    double left_m = 0;  // along its way; straight while it has none
    int detours = 0;    // ways that something stood in
  };
  [[nodiscard]] const std::optional<Heading>& heading() const { return heading_; }
  void head_for(const std::optional<Heading>& heading) { heading_ = heading; }

  // How somebody who steers wants it to move, and since when; nothing: nobody has yet.
  struct Wish {
    model::Twist2 twist;
    Time at;
  };
  [[nodiscard]] const std::optional<Wish>& wish() const { return wish_; }
  void wish(const model::Twist2& twist, Time now) { wish_ = {twist, now}; }

  // Where it will be, and how its wheels turn, if they go on as they were asked to.
  [[nodiscard]] Rolling expected(Time at) const;

  const world::World& world;
  const model::DiffDrive drive;
  Arm wheels;
  Floor floor;

 private:
  struct Turned {
    Time stamp;
    AxisVector wheels_rad;
  };
  Time now_;  // of the last refresh
  std::optional<BaseBelief> belief_;
  Pose2 map_from_base_;
  Odometry odometry_{drive};
  std::optional<Heading> heading_;
  std::optional<Wish> wish_;
  std::deque<Turned> turned_;  // measured, since the newest scan or a little longer
};

}  // namespace pons::skills
