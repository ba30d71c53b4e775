// A task that presses on a block in the small cell, seven axes and every real part; the force is the simulator's own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "pons/sim/truth.hpp"
#include "tests/end_to_end/task_run.hpp"

namespace pons::tests {
namespace {

struct Pressed {
  task::Outcome outcome = task::Outcome::kCancelled;
  std::string reason;
  double peak_n = 0;
  int within_ms = 0;  // of the tolerance, without a break
};

double tolerance_n(double force_n) { return std::max(1.0, 0.05 * force_n); }

Pressed press(TaskRun& cell, double force_n, double tolerance_n) {
  Pressed pressed;
  const sim::Truth truth(cell.simulation());
  int within_ticks = 0;
  cell.run("press", R"({"place":"block","force_n":)" + std::to_string(force_n) + R"(,"seconds":1.0})", [&](Time) {
    const double up_n = truth.force_on_arm_n().z();
    pressed.peak_n = std::max(pressed.peak_n, up_n);
    within_ticks = std::abs(up_n - force_n) <= tolerance_n ? within_ticks + 1 : 0;
    pressed.within_ms = std::max(pressed.within_ms, within_ticks);
  });
  pressed.outcome = cell.outcome;
  pressed.reason = cell.reason;
  std::printf("%.0f N asked for: within %.1f N for %d ms without a break, peak %.1f N\n", force_n, tolerance_n,
              pressed.within_ms, pressed.peak_n);
  EXPECT_EQ(pressed.outcome, task::Outcome::kSucceeded) << pressed.reason;
  EXPECT_EQ(cell.cerebellum().statistics().stops, 0u);
  EXPECT_EQ(cell.cerebellum().statistics().violations, 0u);
  EXPECT_EQ(cell.cerebellum().state().controller, link::Controller::kTracking);
  return pressed;
}

TEST(PressTest, HoldsTheForceThatWasAskedFor) {
  TaskRun cell(small_cell());
  const Pressed pressed = press(cell, 20, tolerance_n(20));
  EXPECT_GE(pressed.within_ms, 1000);
  EXPECT_LT(pressed.peak_n, 30);
}

TEST(PressTest, HoldsALargerForce) {
  TaskRun cell(small_cell());
  const Pressed pressed = press(cell, 50, tolerance_n(50));
  EXPECT_GE(pressed.within_ms, 1000);
  EXPECT_LT(pressed.peak_n, 65);
}

// By what its drives' torques tell, which is less exact.
TEST(PressTest, AnArmWithoutAWristSensorFeelsByItsDrives) {
  TaskRun cell(small_cell("  wrist_sensor: no\n"));
  const Pressed pressed = press(cell, 20, 2);
  EXPECT_GE(pressed.within_ms, 1000);
  EXPECT_LT(pressed.peak_n, 40);
}

}  // namespace
}  // namespace pons::tests
