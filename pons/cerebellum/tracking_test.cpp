// How well the arm follows.
#include <gtest/gtest.h>

#include <cstdio>

#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;

AxisVector somewhere(Random& random) {
  AxisVector q = bench_robot().home;
  for (auto& angle : q) angle += random.uniform(-1.2, 1.2);
  return q;
}

// Ten moves at full limits; returns the worst following error.
double follow_moves(Bench& bench) {
  bench.arm();
  Random random(5);
  for (int i = 0; i < 10; ++i) {
    bench.move(somewhere(random));
    bench.run(1700ms);
    EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
    EXPECT_TRUE(bench.state().motion_end < bench.now);
  }
  return bench.worst_error_rad;
}

struct PlantCase {
  const char* name;
  PlantSettings plant;
  double most_rad;
};

class Tracking : public testing::TestWithParam<PlantCase> {};

TEST_P(Tracking, StaysWithinAMilliradian) {
  Bench bench(GetParam().plant);
  const double worst = follow_moves(bench);
  const Statistics& statistics = bench.cerebellum.statistics();
  std::printf(
      "%s: worst error %.3f mrad; commanded speed %.4f, acceleration %.4f, jerk %.4f, torque %.2f of the limits\n",
      GetParam().name, 1e3 * worst, statistics.commanded.speed, statistics.commanded.acceleration,
      statistics.commanded.jerk, statistics.asked_torque);
  EXPECT_LT(worst, GetParam().most_rad);
  EXPECT_EQ(statistics.violations, 0u);
  EXPECT_LE(statistics.commanded.speed, 1 + 1e-6);
  EXPECT_LE(statistics.commanded.acceleration, 1 + 1e-6);
  EXPECT_LE(statistics.commanded.jerk, 1 + 1e-5);
  EXPECT_GT(statistics.commanded.jerk, 0.99);
}

INSTANTIATE_TEST_SUITE_P(Plants, Tracking,
                         testing::Values(PlantCase{"exact masses, 1 ms", {.step = 1ms}, 1e-3},
                                         PlantCase{"exact masses, 2 ms", {.step = 2ms}, 1e-3},
                                         PlantCase{"masses 5 % heavier, 1 ms", {.step = 1ms, .masses = 1.05}, 1e-3},
                                         PlantCase{"masses 5 % heavier, 2 ms", {.step = 2ms, .masses = 1.05}, 1e-3},
                                         PlantCase{"masses 5 % lighter, 2 ms", {.step = 2ms, .masses = 0.95}, 1e-3}),
                         [](const auto& c) { return "Case" + std::to_string(c.index); });

// A tick that another program held up once it had begun finds the arm where it is some milliseconds later. It must not
// be pulled back: the drives would do so until the next tick.
TEST(HeldUp, AnArmMeasuredAfterTheTickBeganIsNotPulledBack) {
  Bench bench({.step = 1ms});
  get_moving(bench);
  const AxisVector before_nm = bench.plant.set_points.torque_nm;
  bench.plant.advance_to(bench.now + 5ms);
  bench.tick();
  const AxisVector change =
      (bench.plant.set_points.torque_nm - before_nm).cwiseQuotient(bench_robot().limits.torque_nm);
  EXPECT_LT(change.cwiseAbs().maxCoeff(), 0.05);
  bench.now += 4ms;
  bench.run(100ms);
  EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
}

// One fast move of every axis with `carried` on the flange; the worst error.
double move_with(const model::Payload& carried, const model::Payload& told) {
  Settings settings;
  settings.collision.torque_share = 1e9;  // a load that nobody told of, moved so fast, is a collision
  Bench bench({.payload = carried}, settings);
  link::Command command = plain_command(link::CommandKind::kPayload);
  command.payload_kg = told.mass_kg;
  command.payload_com_m = told.com_m;
  bench.send(command);
  bench.arm();
  bench.move(AxisVector(bench_robot().home.array() - 0.7));
  bench.run(1500ms);
  EXPECT_TRUE(bench.operational()) << name(bench.state().cause);
  return bench.worst_error_rad;
}

TEST(Payload, IsCarriedToTheMilliradianWhenItWasTold) {
  const model::Payload payload{.mass_kg = 1.5, .com_m = {0.01, 0, 0.2}};
  const double told = move_with(payload, payload), untold = move_with(payload, {});
  std::printf("payload of 1.5 kg: worst error %.2f mrad when told, %.2f mrad when not\n", 1e3 * told, 1e3 * untold);
  EXPECT_LT(told, 1e-3);
  EXPECT_GT(untold, 10 * told);  // so it is worth telling
}

}  // namespace
}  // namespace pons::cerebellum
