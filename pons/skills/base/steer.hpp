// Drives along a way: looks so far ahead, tries a few manners of driving in thought, and gives the motion of the wheels
// for the best one that has room. Each such motion ends at rest: who never asks again, stops.
//
// Regulated pure pursuit (Macenski, Singh, Martín, Ginés 2023): towards a point some way ahead on the way, along the
// arc that leads there (Coulter 1992), slower where the arc is tight, the room is scarce or the end is near; on the
// spot where the way turns sharply, and at its end.
#pragma once

#include <optional>

#include "pons/core/time.hpp"
#include "pons/model/diff_drive.hpp"
#include "pons/motion/motion.hpp"
#include "pons/skills/base/floor.hpp"
#include "pons/skills/base/way.hpp"

namespace pons::skills {

// What is asked of the base: its speed, that of turning, and their limits within a share of the wheels'.
struct DriveLimits {
  double ahead_m_s = 0, ahead_m_s2 = 0, ahead_m_s3 = 0;
  double turn_rad_s = 0, turn_rad_s2 = 0, turn_rad_s3 = 0;
};
// Whatever speed and turning do within these at the same time, the wheels' limits hold. The speed keeps below the
// base's own limit by what real wheels may be larger than drawn ones.
[[nodiscard]] DriveLimits drive_limits(const world::Base& base, const AxisLimits& wheels);

// Where the base is at a moment, and how it moves.
struct Rolling {
  Pose2 map_from_base;
  AxisState wheels;
};

struct Steered {
  motion::Trajectory wheels;
  bool arrives = false;  // it ends at the goal
};

// Whether it is known what room there is, which it is where the base knows where it stands.
enum class Room : std::uint8_t { kKnown, kUnknown };

class Steer {
 public:
  // All must outlive it.
  Steer(const Floor& floor, const world::Base& base, const AxisLimits& wheels);

  // From now on along this way, to this heading at its end.
  void follow(Way way, double end_yaw);
  [[nodiscard]] const Way& way() const { return way_; }

  // The motion from `at` on. Nothing: there is no room for any, not even for turning.
  [[nodiscard]] std::optional<Steered> look_ahead(const Rolling& start, Time at);
  // Likewise, without a way: brings it to such a speed and turning, or to as much of them as its limits and the room
  // allow, holds that for a while, and comes to rest. Where the room is unknown it creeps.
  [[nodiscard]] std::optional<motion::Trajectory> hold(const Rolling& start, Time at, const model::Twist2& wished,
                                                       Room room) const;

 private:
  struct Manner {
    double speed_share, look_m;
  };
  // The base in thought.
  struct Thought {
    Pose2 pose;
    model::Twist2 speed, rate;
    std::size_t leg = 0;  // of the way that it is on
  };
  [[nodiscard]] std::optional<Steered> try_out(const Rolling& start, Time at, const Manner& manner) const;
  [[nodiscard]] bool has_room(const Rolling& start, const motion::Trajectory& wheels) const;
  [[nodiscard]] model::Twist2 wish(Thought& thought, const Manner& manner) const;
  [[nodiscard]] model::Twist2 turn_to(const Thought& thought, double yaw) const;
  [[nodiscard]] double speed_here(const Thought& thought) const;
  void step(Thought& thought, const model::Twist2& wished, AxisState& wheels, Segment& piece) const;
  [[nodiscard]] bool is_done(const Thought& thought) const;

  const Floor& floor_;
  const model::DiffDrive drive_;
  const AxisLimits& wheel_limits_;
  const DriveLimits limits_;
  Way way_;
  double end_yaw_ = 0;
};

}  // namespace pons::skills
