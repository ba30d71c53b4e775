// A task that lets itself be pushed aside, seven axes and every real part: how far is the simulator's own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "pons/model/robot_model.hpp"
#include "tests/end_to_end/task_run.hpp"

namespace pons::tests {
namespace {

using namespace std::chrono_literals;

// Pushed with 12 N for two seconds in one direction, then let go; the tip's way at the end of each.
TEST(YieldTest, GivesWayAsTheSpringThatWasAskedForAndComesBack) {
  constexpr double kPush_n = 12, kStiffness_n_m = 400;
  for (const Vector3& along : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, -1)}) {
    TaskRun cell(small_cell());
    auto model = model::RobotModel::load(cell.world().robot).value();
    Vector3 before = Vector3::Zero(), pushed = before, released = before;
    bool yielded = false;
    Time began;
    cell.run("yield", R"({"seconds":6,"stiffness_n_m":400})", [&](Time now) {
      const link::State& state = cell.cerebellum().state();
      if (state.controller != link::Controller::kImpedance) return;
      const Vector3 tip = model.world_from_tip(state.position).translation();
      if (!yielded) {
        yielded = true;
        began = now;
        before = tip;
      }
      const Duration since = now - began;
      cell.simulation().push_tip(since > 1s && since < 3s ? Vector3(kPush_n * along) : Vector3(Vector3::Zero()));
      if (since < 3s) pushed = tip;
      released = tip;
    });
    EXPECT_EQ(cell.outcome, task::Outcome::kSucceeded) << cell.reason;
    const double way_m = along.dot(pushed - before), back_m = (released - before).norm();
    std::printf("pushed with %.0f N: %.2f mm, so %.1f N/m of %.0f; let go: %.2f mm off\n", kPush_n, 1e3 * way_m,
                kPush_n / way_m, kStiffness_n_m, 1e3 * back_m);
    EXPECT_NEAR(kPush_n / way_m, kStiffness_n_m, 0.05 * kStiffness_n_m);
    EXPECT_LT(back_m, 1e-3);
    EXPECT_EQ(cell.cerebellum().statistics().stops, 0u);
    EXPECT_EQ(cell.cerebellum().statistics().violations, 0u);
    EXPECT_EQ(cell.cerebellum().state().controller, link::Controller::kTracking);
  }
}

// Pushed harder than any spring is meant for, it is a collision all the same, and the task is tried again.
TEST(YieldTest, AHardBlowIsStillACollision) {
  TaskRun cell(small_cell());
  bool struck = false;
  Time began;
  cell.run("yield", R"({"seconds":2})", [&](Time now) {
    if (cell.cerebellum().state().controller == link::Controller::kImpedance && began == Time{}) began = now;
    const bool strikes = began != Time{} && now - began > 500ms && now - began < 550ms;
    cell.simulation().push_tip(strikes ? Vector3(400, 0, 0) : Vector3(Vector3::Zero()));
    struck = struck || cell.cerebellum().state().cause == link::StopCause::kCollision;
  });
  EXPECT_TRUE(struck);
  EXPECT_EQ(cell.outcome, task::Outcome::kSucceeded) << cell.reason;
}

}  // namespace
}  // namespace pons::tests
