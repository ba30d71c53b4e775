// What both runners take and give back.
#pragma once

#include <cstdint>
#include <functional>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/link.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/camera_crew.hpp"
#include "pons/runner/plant.hpp"

namespace pons::runner {

inline constexpr Duration kControlPeriod = std::chrono::milliseconds(1);

struct Parts {
  Plant plant;
  cerebellum::Cerebellum* cerebellum = nullptr;
  link::CerebellumEnd* link = nullptr;
  BridgeSide* bridge_side = nullptr;
  CameraCrew* crew = nullptr;
};

// How the run is broken off and watched. Both are called once a bridge period, on the bridge's thread; may be empty.
struct Watch {
  std::function<bool()> interrupted;
  std::function<void(Time)> progress;
  Time limit;  // a run that takes longer is broken off
};

struct LoopFigures {
  std::uint64_t ticks = 0, missed = 0;
  double p50_us = 0, p99_us = 0;  // time of one control step
  std::string degraded;           // real time only: what the operating system refused; empty when nothing
};

struct RunResult {
  Time end;
  bool complete = false;  // false: broken off
  LoopFigures loop;
};

}  // namespace pons::runner
