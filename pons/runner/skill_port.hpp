// The skills as the runner sees them; it knows none by name.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/core/belief.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"

namespace pons::runner {

// How well the cups hold now, by their vacuum.
struct Grip {
  double share = 1;   // of their full force, once sealed; above 0
  bool lifts = true;  // false: they do not seal well enough to lift anything
};

// Of one robot.
struct SkillPort {
  std::string name = "arm";  // the robot's, as the world has it
  std::size_t robot = 0;     // as the bridge counts them
  // Before any skill is ticked: the beliefs, and after them what the view's border cuts; and when the newest frame of
  // the belt was taken that they come from.
  std::function<void(Time, std::vector<ObjectBelief>, Time)> refresh;
  std::function<void(const BaseBelief&)> locate;  // with each scan of a base's lidar; may be empty
  // Gives the codes to those unread that are known without a camera, as of the last refresh; may be empty.
  std::function<void(std::vector<ObjectBelief>&)> label;
  // What lies on the belt besides, as of the last refresh, which no camera has seen there; may be empty.
  std::function<std::vector<ObjectBelief>()> unseen;
  std::function<const link::State&()> state;                   // as of the last refresh
  std::function<std::vector<std::uint32_t>()> take_forgotten;  // tracks that were taken off the belt
  // What is found to have come along with others, or not to have fallen where it was let go of, {"code", "fell_into"}
  // each (see skills::Stray), since the last call; may be empty.
  std::function<std::vector<bridge::Json>()> take_strays;
  std::function<void(Time)> arm;                // one step out of a stop, towards operational
  std::function<double()> outside_rad;          // how far the arm stands outside its position limits
  std::function<Expected<void>(Time)> recover;  // one step from there to inside them
  std::function<void(Time)> rest;               // once a period while no skill runs,
  std::function<void(Time)> park;               // or this, out of the cameras' view; may be empty
  std::function<void(const Grip&)> grip;        // once a period; may be empty
  std::function<void(link::Belt)> belt;         // once a period
  std::function<bool(Time)> holds_belt = [](Time) { return false; };  // whether what the arm does wants it to wait
  std::function<void()> halt;                                         // a protective stop
  std::function<void()> raise_emergency, release_emergency;           // the link's emergency word
  std::function<const bridge::Json&()> carries;                       // what is on the cups; null when nothing is
  double takes_until_m = 0;                                           // where along the belt it takes hold last
  // Of one that no longer works: whether what rides along the belt passes it where it stands.
  std::function<bool()> lets_pass = [] { return true; };
  // After a bridge that is no more: believes what that one wrote of carries(); what becomes of a task that it had
  // begun; and, each tick once the arm is armed, brings it to where others may move it from: true when that is done.
  // What that bridge alone had seen counts as an obstacle from restore() on.
  std::function<void(const bridge::Json&)> restore;
  bridge::Resume resume;
  std::function<bool(Time)> settle;
};

}  // namespace pons::runner
