// A bench for the cerebellum: the arm's rigid-body dynamics as a plant with errors of its own, and a bridge's hand.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/cerebellum/cerebellum.hpp"

namespace pons::cerebellum {

// As pons/model's tests: six axes, hung above a belt. masses: every mass and inertia of the arm times this.
[[nodiscard]] model::RobotModel bench_model(double masses = 1);
[[nodiscard]] const world::Robot& bench_robot();

struct PlantSettings {
  Duration step{2'000'000};              // the plant's own; measurements are as old as that
  double masses = 1;                     // of the plant over the controller's model
  model::Payload payload;                // what the plant carries, told or not
  Duration drive_delay{0};               // whole milliseconds: set-points act so much later
  Duration told_delay{0};                // what the controller takes that for
  std::optional<double> axis_2_max_rad;  // the controller's limit there, instead of the robot's
};

// Integrates the arm's dynamics (semi-implicit Euler); brakes hold it while the drives are off.
class Plant {
 public:
  Plant(const PlantSettings& settings, const AxisVector& position);
  void advance_to(Time time);              // once a tick of the controller
  void place(const AxisVector& position);  // at rest there, without a way
  void lose_load() { settings_.payload = {}; }
  body::Sensors sensors;
  body::SetPoints set_points;
  AxisVector extra_torque_nm;  // from outside, at the joints
  bool blocked = false;        // as by a wall: cannot move
  bool silent = false;         // the measurement stays as it is

 private:
  PlantSettings settings_;
  model::RobotModel model_;
  DelayLine<body::SetPoints> told_;
  AxisVector position_, speed_;
  Time time_;
};

// Cerebellum, link and plant together, a tick at a time.
class Bench {
 public:
  explicit Bench(const PlantSettings& plant_settings = {}, const Settings& settings = {});

  void run(Duration duration);  // with heartbeats every 10 ms unless `mute`
  void tick();
  void send(link::Command command);      // sequence and present epoch filled in
  void send_old(link::Command command);  // likewise, but the epoch before
  void move(const AxisVector& to);       // from the commanded state 20 ms ahead, as a splice
  void move(const std::vector<Segment>& motion);
  void arm();  // runs until operational
  [[nodiscard]] const link::State& state() const { return cerebellum.state(); }
  [[nodiscard]] bool operational() const { return state().safety == link::SafetyState::kOperational; }
  [[nodiscard]] double error_rad() const;  // now, commanded against the plant's truth

  Time now;
  std::unique_ptr<link::Link> link = std::make_unique<link::Link>();
  link::BridgeEnd bridge{*link};
  link::CerebellumEnd end{*link};
  Cerebellum cerebellum;
  Plant plant;
  bool mute = false;
  std::function<void(body::Sensors&)> spoil;  // what comes between measurement and cerebellum
  double worst_error_rad = 0;                 // since arming

 private:
  std::uint64_t sequence_ = 0;
  AxisVector position_before_;
};

// Armed, and some 300 ms into a fast motion of every axis; a failed test where it is not.
void get_moving(Bench& bench);

// From rest to rest, all axes in the time of the slowest, each as its own profile.
[[nodiscard]] std::vector<Segment> point_to_point(const AxisState& start, Time at, const AxisVector& to,
                                                  const AxisLimits& limits);

[[nodiscard]] inline link::Command motion_command(const Segment& segment, bool splice) {
  link::Command command;
  command.kind = link::CommandKind::kMotion;
  command.splice = splice;
  command.segment = segment;
  return command;
}

[[nodiscard]] inline link::Command plain_command(link::CommandKind kind) {
  link::Command command;
  command.kind = kind;
  return command;
}

}  // namespace pons::cerebellum
