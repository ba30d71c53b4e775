// A copy of a simulation that steps with mj_step and nothing else: what a benchmark holds the simulation's cost
// against.
#pragma once

#include <cstdint>
#include <memory>

#include "pons/body/body.hpp"
#include "pons/core/time.hpp"

namespace pons::sim {

class Simulation;

// Has the arm's torques; no feeder, no belt drive, no vacuum, no brakes, no measurements, no account. What these had
// set when it was copied stays as it was. One thread, that of the simulation, which must outlive it.
class BareStep {
 public:
  explicit BareStep(const Simulation& simulation);
  ~BareStep();
  BareStep(const BareStep&) = delete;
  BareStep& operator=(const BareStep&) = delete;

  // Model, state and set-points become those that the simulation has now.
  void copy();
  // As Simulation::advance_to.
  void advance_to(Time time);
  // As Body::write.
  void write(const body::SetPoints& set_points);
  // As Simulation::state_digest.
  [[nodiscard]] std::uint64_t state_digest() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::sim
