// Whether a body keeps its contract (body.hpp): a kit that any body, simulated or real, can be run against. A real arm
// moves in it, slowly and not far: nobody stands near.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pons/body/body.hpp"

namespace pons::body {

// The body and what the kit needs beside the contract.
struct Subject {
  Body& body;
  std::function<void(Time)> advance;       // lets its time go on to there: waits, or steps a simulation
  std::function<std::uint32_t()> cups_on;  // which cups it drives, as somebody beside it sees
  AxisVector push_nm;                      // a torque an axis under which it moves from where it stands; 0: it falls
  Time now;                                // its time
  Duration period = std::chrono::milliseconds(1);  // between two set-points
};

// What it does otherwise than the contract says, a line each; empty: nothing. Moves the arm several times for a little
// longer than its watchdog takes.
[[nodiscard]] std::vector<std::string> nonconformities(Subject& subject);

}  // namespace pons::body
