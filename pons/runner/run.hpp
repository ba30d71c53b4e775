// What both runners take and give back.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/link.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/crashes.hpp"
#include "pons/runner/observer.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/runner/plant.hpp"

namespace pons::runner {

inline constexpr Duration kControlPeriod = std::chrono::milliseconds(1);

// What each robot has on its side of its link.
struct RobotParts {
  std::string name;  // before what its loop says; empty where there is no other
  body::Body* body = nullptr;
  cerebellum::Cerebellum* cerebellum = nullptr;
  link::CerebellumEnd* link = nullptr;
};

// On the robots' side of the link.
struct BodyParts {
  Plant plant;
  std::vector<RobotParts> robots;  // one; in lockstep at most kMaxArms
  Photographer* photographer = nullptr;
};

struct Parts {
  BodyParts body;
  BridgeSide* bridge_side = nullptr;
  Observer* observer = nullptr;
  // In lockstep only: these kill and replace the two above, those the robots' loops.
  Crashes* crashes = nullptr;
  LoopCrashes* loop_crashes = nullptr;
};

// How the run is broken off and watched. All are called in every bridge period, on the bridge's thread; may be empty.
struct Watch {
  std::function<bool()> interrupted;
  std::function<void(Time)> progress;
  std::function<void(Time, std::string_view)> said;  // an event of the control loop: stops, arming, refused commands
  std::function<void(std::string_view)> alerted;     // a part came to be worse: a line (Health::take_alerts)
  std::function<void(std::string_view)> refused;     // real time only: what the operating system refused, at the start
  Time limit;                                        // a run that takes longer is broken off
  bool attended = true;  // somebody can come to reset a robot; else a run in which all wait for that is broken off
};

// From a tick's time to its begin.
struct Lateness {
  double p50_us, p99_us, max_us;
};

struct LoopFigures {
  std::uint64_t ticks = 0, missed = 0;
  double p50_us = 0, p99_us = 0;  // time of one control step
  std::optional<Lateness> late;   // real time only
};

// Time of one bridge tick.
struct BridgeFigures {
  double p50_ms = 0, p99_ms = 0, max_ms = 0;
};

struct RunResult {
  Time end;
  bool complete = false;   // false: broken off
  std::string broken_off;  // why, where this process did
  LoopFigures loop;
  std::optional<BridgeFigures> bridge;  // real time only: in lockstep a tick waits for the cameras' frames
  std::string degraded;  // real time only: what the operating system refused this process; empty when nothing
};

// Tells the watch what the control loops have said since the last time.
inline void pass_on_events(BodyParts& body, const Watch& watch) {
  if (!watch.said) return;
  for (const RobotParts& robot : body.robots) {
    robot.cerebellum->log().drain([&](Time at, std::string_view text) {
      watch.said(at, robot.name.empty() ? std::string(text) : robot.name + ": " + std::string(text));
    });
  }
}

}  // namespace pons::runner
