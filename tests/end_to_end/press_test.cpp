// A task that presses on a block in the small cell, seven axes and every real part; the force is the simulator's own.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "apps/assembly.hpp"
#include "pons/sim/truth.hpp"

namespace pons::tests {
namespace {

namespace fs = std::filesystem;

void put_in(const fs::path& file, const std::string& before, const std::string& line) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto at = text.find(before);
  ASSERT_NE(at, std::string::npos) << before;
  std::ofstream(file) << text.insert(at, line);
}

// The small cell with a block to press on, beside the arm.
world::World with_block() {
  const fs::path worlds = fs::path(testing::TempDir()) / "press_worlds";
  fs::remove_all(worlds);
  fs::copy(PONS_WORLDS_SOURCE, worlds, fs::copy_options::recursive);
  put_in(worlds / "small_cell" / "world.yaml", "  - {name: tray, kind: tray",
         "  - {name: block, kind: region, center: [-0.40, -0.82, 0.66], size: [0.20, 0.20, 0.08]}\n");
  put_in(worlds / "small_cell" / "scene.xml", "    <geom name=\"floor\"",
         "    <geom name=\"block\" pos=\"-0.40 -0.82 0.66\" size=\"0.1 0.1 0.04\"/>\n");
  auto world = world::load(worlds, "small_cell");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

class PressTest : public testing::Test {
 protected:
  // Runs in lockstep until the task has its outcome, noting the force on the arm.
  void press(double force_n) {
    force_n_ = force_n;
    ASSERT_TRUE(cell_->above->bridge->submit(
        R"({"id":"press","steps":[{"skill":"press","arguments":{"place":"block","force_n":)" + std::to_string(force_n) +
            R"(,"seconds":1.0}}]})",
        Time{}));
    runner::Parts parts = cell_->parts();
    const sim::Truth truth(*cell_->body->simulation);
    body::Sensors sensors;
    body::SetPoints set_points;
    for (Time now = Time(runner::kControlPeriod); now < Time(from_s(40)); now += runner::kControlPeriod) {
      parts.body.plant.advance(now);
      parts.body.plant.body->read(sensors);
      parts.body.photographer->open_shutters(now, sensors);
      cell_->body->cerebellum->step(now, sensors, *parts.body.link, set_points);
      parts.body.plant.body->write(set_points);
      note(truth.force_on_arm_n().z());
      if (now.ns() % runner::kBridgePeriod.count() != 0) continue;
      const auto ticked = parts.bridge_side->tick(now, *parts.observer);
      ASSERT_TRUE(ticked) << ticked.error().line();
      const auto task = cell_->above->journal->task("press");
      ASSERT_TRUE(task && *task);
      if (const auto& ended = (*task)->record.outcome) {
        outcome_ = ended->outcome;
        reason_ = ended->reason;
        return;
      }
    }
  }
  void note(double up_n) {
    peak_n_ = std::max(peak_n_, up_n);
    const bool within = std::abs(up_n - force_n_) <= std::max(1.0, 0.05 * force_n_);
    within_ticks_ = within ? within_ticks_ + 1 : 0;
    longest_ticks_ = std::max(longest_ticks_, within_ticks_);
  }

  const world::World world_ = with_block();
  const std::unique_ptr<apps::Assembly> cell_ =
      apps::Assembly::build(world_, world::draw_manifest(world_, 1, 1).value(), {.journal = ":memory:"}).value();
  double force_n_ = 0, peak_n_ = 0;
  int within_ticks_ = 0, longest_ticks_ = 0;
  task::Outcome outcome_ = task::Outcome::kCancelled;
  std::string reason_;
};

TEST_F(PressTest, HoldsTheForceThatWasAskedFor) {
  press(20);
  std::printf("20 N asked for: within 1 N for %d ms without a break, peak %.1f N\n", longest_ticks_, peak_n_);
  EXPECT_EQ(outcome_, task::Outcome::kSucceeded) << reason_;
  EXPECT_GE(longest_ticks_, 1000);
  EXPECT_LT(peak_n_, 30);
  EXPECT_EQ(cell_->body->cerebellum->statistics().stops, 0u);
  EXPECT_EQ(cell_->body->cerebellum->statistics().violations, 0u);
  EXPECT_EQ(cell_->body->cerebellum->state().controller, link::Controller::kTracking);
}

TEST_F(PressTest, HoldsALargerForce) {
  press(50);
  std::printf("50 N asked for: within 2.5 N for %d ms without a break, peak %.1f N\n", longest_ticks_, peak_n_);
  EXPECT_EQ(outcome_, task::Outcome::kSucceeded) << reason_;
  EXPECT_GE(longest_ticks_, 1000);
  EXPECT_LT(peak_n_, 65);
}

}  // namespace
}  // namespace pons::tests
