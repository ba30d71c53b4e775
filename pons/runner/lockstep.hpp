// One deterministic schedule in virtual time, as fast as the processor allows: the same seed gives the same bytes.
#pragma once

#include <cstdint>
#include <functional>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/link/link.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/camera_crew.hpp"
#include "pons/runner/plant.hpp"

namespace pons::runner {

inline constexpr Duration kControlPeriod = std::chrono::milliseconds(1);

// How the run is broken off and watched. Both are called once a bridge period; may be empty.
struct Watch {
  std::function<bool()> interrupted;
  std::function<void(Time)> progress;
  Time limit;  // a run that takes longer is broken off
};

struct LoopFigures {
  std::uint64_t ticks = 0, missed = 0;
  double p50_us = 0, p99_us = 0;  // processor time of one control step
};

struct RunResult {
  Time end;
  bool complete = false;  // false: broken off
  LoopFigures loop;
};

// What both runners run.
struct Parts {
  Plant plant;
  cerebellum::Cerebellum* cerebellum = nullptr;
  link::CerebellumEnd* link = nullptr;
  BridgeSide* bridge_side = nullptr;
  CameraCrew* crew = nullptr;
};

// Error: body, camera or journal failed.
[[nodiscard]] Expected<RunResult> run_lockstep(Parts& parts, const Watch& watch);

}  // namespace pons::runner
