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

class SimBody final : public body::Body {
 public:
  explicit SimBody(Cell* cell) : cell_(cell) {}
  void read(body::Sensors& sensors) PONS_NONBLOCKING override;
  void write(const body::SetPoints& set_points) PONS_NONBLOCKING override;
  [[nodiscard]] Duration watchdog() const override;

 private:
  Cell* cell_;
};

struct Cell {
  Cell(const world::World& world, const world::Manifest& manifest, Composed composed, std::uint64_t seed,
       const world::FaultPlan& plan = {});

  // One physics step: feeder, belt, vacuum, drives, MuJoCo, measurements, account.
  void step();
  // Set-points reach the drives.
  void hear(const body::SetPoints& told, Time at) PONS_NONBLOCKING;

  world::World world;
  Composed composed;
  DataPtr data;
  Faults faults;
  std::vector<Arrival> arrivals;
  BeltDrive belt;
  Gripper gripper;
  Ledger ledger;
  Feeder feeder;
  Curtains curtains;
  LabelStore labels;
  std::vector<std::unique_ptr<SimCamera>> cameras;
  std::vector<body::Camera*> camera_list;
  SimBody body;
  Random noise;                // of wrist and vacuum
  Bus bus;                     // set-points on their way
  body::SetPoints set_points;  // in force
  body::Sensors measured;      // at the last step
  Duration step_length;
  Time stepped;  // end of the last step
  Time now;      // last time advanced to
  bool stop_pressed = false;
  Vector3 push_n = Vector3::Zero();  // of a person on the tip
  std::vector<Visit> visits;
  Time heard;                     // when set-points last reached the drives
  bool watchdog_tripped = false;  // until set-points without power are heard
  AxisVector held;                // where the brakes hold the arm; empty while it moves
  std::string failure;            // what MuJoCo said when it gave up

 private:
  std::vector<double> brake_acceleration_, brake_torque_;  // scratch, one a degree of freedom

  void drive_belt();
  void watch_loop();
  void drive();
  void push();
  void brake();
  void measure();
};

}  // namespace pons::sim
