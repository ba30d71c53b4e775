// Everything a simulation consists of. Private to pons/sim; truth.cpp reads it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/random.hpp"
#include "pons/sim/bus.hpp"
#include "pons/sim/camera.hpp"
#include "pons/sim/compose.hpp"
#include "pons/sim/curtains.hpp"
#include "pons/sim/faults.hpp"
#include "pons/sim/feeder.hpp"
#include "pons/sim/gripper.hpp"
#include "pons/sim/ledger.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/world/world.hpp"

namespace pons::sim {

struct Cell;

// One arm of the cell: what it is told, what it measures, what holds it.
struct SimArm final : body::Body {
  SimArm(Cell& cell, std::size_t index, std::uint64_t seed);

  void read(body::Sensors& sensors) PONS_NONBLOCKING override;
  void write(const body::SetPoints& told) PONS_NONBLOCKING override;
  [[nodiscard]] Duration watchdog() const override;
  // Set-points reach the drives.
  void hear(const body::SetPoints& told, Time at) PONS_NONBLOCKING;

  // A physics step, in this order: what has come over the bus; the drives or the brakes; after it the measurements.
  void listen();
  void drive();
  void push();
  void measure();

  Cell& cell;
  const world::World& station;  // what it has of the world
  const ComposedArm& composed;
  Gripper gripper;
  Curtains curtains;                 // of its mouths
  Random noise;                      // of wrist and vacuum
  Bus bus;                           // set-points on their way
  body::SetPoints set_points;        // in force
  body::Sensors measured;            // at the last step
  Vector3 push_n = Vector3::Zero();  // of a person on the tip
  Time heard;                        // when set-points last reached the drives
  bool watchdog_tripped = false;     // until set-points without power are heard
  AxisVector held;                   // where the brakes hold the arm; empty with power

 private:
  std::vector<double> brake_acceleration_, brake_torque_;  // scratch, one a degree of freedom

  void brake();
};

struct Cell {
  Cell(const world::World& world, const world::Manifest& manifest, Composed composed, std::uint64_t seed,
       const world::FaultPlan& plan = {});
  Cell(const Cell&) = delete;
  Cell& operator=(const Cell&) = delete;

  // One physics step: feeder, belt, vacuum, drives, MuJoCo, measurements, account.
  void step();
  [[nodiscard]] SimArm& arm(std::size_t i = 0) { return *arms[i]; }
  [[nodiscard]] const SimArm& arm(std::size_t i = 0) const { return *arms[i]; }

  world::World world;
  Composed composed;
  DataPtr data;
  Faults faults;
  std::vector<Arrival> arrivals;
  BeltDrive belt;
  std::vector<std::unique_ptr<SimArm>> arms;
  Ledger ledger;
  Feeder feeder;
  LabelStore labels;
  std::vector<std::unique_ptr<SimCamera>> cameras;
  std::vector<body::Camera*> camera_list;
  Duration step_length;
  Time stepped;  // end of the last step
  Time now;      // last time advanced to
  bool stop_pressed = false;
  std::vector<Visit> visits;
  std::string failure;  // what MuJoCo said when it gave up

 private:
  void drive_belt();
  [[nodiscard]] bool belt_may_run() const;
  [[nodiscard]] std::vector<ArmStep> arm_steps() const;
};

}  // namespace pons::sim
