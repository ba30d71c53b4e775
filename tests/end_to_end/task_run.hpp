// One task in a whole cell, in lockstep, with a look at the simulator's own truth in each tick.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "apps/assembly.hpp"

namespace pons::tests {

// The small cell with a block to press on, beside the arm; `robot_lines` are added to the file's robot.
[[nodiscard]] world::World small_cell_with_block(const std::string& robot_lines = {});

class TaskRun {
 public:
  explicit TaskRun(world::World world);

  // Submits the task of this one step, and runs until it has its outcome, `each_tick` after every control step.
  void run(const std::string& skill, const std::string& arguments, const std::function<void(Time)>& each_tick);

  [[nodiscard]] sim::Simulation& simulation() { return *cell_->body->simulation; }
  [[nodiscard]] const cerebellum::Cerebellum& cerebellum() const { return *cell_->body->cerebellum; }
  [[nodiscard]] const world::World& world() const { return world_; }

  task::Outcome outcome = task::Outcome::kCancelled;
  std::string reason;

 private:
  const world::World world_;
  const std::unique_ptr<apps::Assembly> cell_;
};

}  // namespace pons::tests
