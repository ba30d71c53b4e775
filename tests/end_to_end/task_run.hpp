// One task in a whole cell, in lockstep, with a look at the simulator's own truth in each tick.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/assembly.hpp"

namespace pons::tests {

// The small cell with a block to press on, beside the arm; `robot_lines` are added to the file's robot.
[[nodiscard]] world::World small_cell(const std::string& robot_lines = {});

class TaskRun {
 public:
  explicit TaskRun(world::World world, std::int64_t parcels = 1, std::uint64_t seed = 1);

  // One control step and, where one is due, the bridge's tick after it.
  void step();
  // Submits the task of this one step, and runs until it has its outcome, `each_tick` after every control step.
  void run(const std::string& skill, const std::string& arguments, const std::function<void(Time)>& each_tick);
  // Likewise of a task that somebody submits, for so long at most.
  void await(const std::string& id, Duration longest, const std::function<void(Time)>& each_tick);
  // Until the brain has sorted all that came; true unless it takes too long.
  [[nodiscard]] bool finish(const std::function<void(Time)>& each_tick);

  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] sim::Simulation& simulation() { return *cell_->body->simulation; }
  [[nodiscard]] const cerebellum::Cerebellum& cerebellum() const { return *cell_->body->arms.front()->cerebellum; }
  [[nodiscard]] const world::World& world() const { return world_; }
  [[nodiscard]] bridge::Bridge& bridge() { return *cell_->above->bridge; }
  [[nodiscard]] const bridge::Journal& journal() const { return *cell_->above->journal; }
  [[nodiscard]] apps::BodyHalf& body() { return *cell_->body; }
  [[nodiscard]] apps::BridgeHalf& above() { return *cell_->above; }

  // Of the task that was awaited.
  task::Outcome outcome = task::Outcome::kCancelled;
  std::string reason;
  task::Json detail;

 private:
  const world::World world_;
  const std::unique_ptr<apps::Assembly> cell_;
  runner::Parts parts_;
  std::vector<body::Sensors> sensors_;  // of each robot
  std::vector<body::SetPoints> set_points_;
  Time now_;
};

}  // namespace pons::tests
