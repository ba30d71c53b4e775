#include "pons/sim/simulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "pons/sim/cell.hpp"
#include "pons/sim/puppet.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

world::World load(std::string_view name) {
  auto world = world::load("worlds", name);
  if (!world) throw std::runtime_error(world.error().line());
  return *world;
}

world::World without_cameras(std::string_view name) {
  world::World world = load(name);
  world.cameras.clear();
  return world;
}

world::Manifest draw(const world::World& world, int count, std::uint64_t seed) {
  auto manifest = world::draw_manifest(world, count, seed);
  if (!manifest) throw std::runtime_error(manifest.error().line());
  return *manifest;
}

world::Manifest one_box(double mass_kg) {
  world::ManifestRow row;
  row.parcel_id = "P000001";
  row.destination = "chute_2";
  row.size_m = Vector3(0.24, 0.18, 0.12);
  row.mass_kg = mass_kg;
  return {row};
}

std::unique_ptr<Simulation> create(const world::World& world, const world::Manifest& manifest, std::uint64_t seed) {
  auto simulation = Simulation::create(world, manifest, seed);
  if (!simulation) throw std::runtime_error(simulation.error().line());
  (*simulation)->run_belt();
  return std::move(*simulation);
}

TEST(Simulation, BeltCarriesAParcelAsFarAsTheEncoderSays) {
  const world::World world = without_cameras("parcel_cell");
  auto simulation = create(world, one_box(1.0), 3);
  const Truth truth(*simulation);
  simulation->advance_to(Time(from_s(1.0)));
  ASSERT_TRUE(truth.top(0).has_value());
  body::Sensors before, after;
  simulation->body().read(before);
  const double x_before = truth.top(0)->translation().x();
  simulation->advance_to(Time(from_s(4.0)));
  simulation->body().read(after);
  const double moved = truth.top(0)->translation().x() - x_before;
  EXPECT_GT(after.belt_travel_m - before.belt_travel_m, 3 * 0.7 * world.belt.speed_m_s);
  EXPECT_NEAR(moved, after.belt_travel_m - before.belt_travel_m, 0.002);
  EXPECT_EQ(truth.parcels()[0].where, Whereabouts::kBelt);
}

// Along its ramp, and what lies on it comes along, stays where it is, and goes on.
TEST(Simulation, BeltStandsUnlessItIsLetRun) {
  const world::World world = without_cameras("small_cell");
  auto simulation = create(world, draw(world, 8, 3), 3);
  const Truth truth(*simulation);
  const body::SetPoints stand{.torque_nm = AxisVector::Zero(world.robot.home.size())};
  body::Sensors sensors;
  double now_s = 0, lies_m = 0;
  const auto pass = [&](double seconds) {
    simulation->advance_to(Time(from_s(now_s += seconds)));
    simulation->body().read(sensors);
    lies_m = truth.top(0)->translation().x();
  };
  pass(0.1);
  ASSERT_TRUE(truth.top(0));
  for (const double runs_s : {0.3, 2.0}) {
    simulation->body().write(stand);
    pass(world.belt.speed_m_s / world.belt.ramp_m_s2 + 0.3);
    EXPECT_EQ(sensors.belt_speed_m_s, 0);
    const double stood_m = lies_m, travel_m = sensors.belt_travel_m;
    pass(10);
    EXPECT_NEAR(lies_m, stood_m, 5e-4);
    EXPECT_EQ(sensors.belt_travel_m, travel_m);
    simulation->run_belt();
    pass(runs_s);
    EXPECT_NEAR(lies_m - stood_m, sensors.belt_travel_m - travel_m, 0.002);
    EXPECT_GT(sensors.belt_speed_m_s, 0.7 * world.belt.speed_m_s);
  }
}

TEST(Simulation, SpeedWandersWithinItsBounds) {
  const world::World world = without_cameras("parcel_cell");
  auto simulation = create(world, one_box(1.0), 3);
  double slowest = 1, fastest = 0;
  for (int i = 10; i <= 300; ++i) {  // it has started by then
    simulation->advance_to(Time(from_s(0.1 * i)));
    body::Sensors sensors;
    simulation->body().read(sensors);
    slowest = std::min(slowest, sensors.belt_speed_m_s);
    fastest = std::max(fastest, sensors.belt_speed_m_s);
  }
  EXPECT_GE(slowest, world.belt.speed_m_s * (1 - world.belt.speed_variation));
  EXPECT_LE(fastest, world.belt.speed_m_s * (1 + world.belt.speed_variation));
  EXPECT_GT(fastest - slowest, 0.2 * world.belt.speed_m_s);
}

TEST(Simulation, UnpickedParcelRidesIntoTheExceptionChuteAndIsCarriedOff) {
  auto simulation = create(without_cameras("parcel_cell"), one_box(1.0), 3);
  const Truth truth(*simulation);
  EXPECT_FALSE(simulation->finished());
  for (int i = 1; i <= 20 && !simulation->finished(); ++i) simulation->advance_to(Time(from_s(i)));
  EXPECT_TRUE(simulation->finished());
  EXPECT_EQ(truth.parcels()[0].where, Whereabouts::kException);
  EXPECT_EQ(truth.parcels()[0].place, "exception");
  EXPECT_GT(truth.parcels()[0].max_drop_m, 0.2);
  EXPECT_LT(truth.parcels()[0].max_drop_m, 0.6);
  simulation->advance_to(Time(from_s(25)));
  EXPECT_FALSE(truth.top(0).has_value());
}

TEST(Simulation, ThirtySecondsOfFeedingRaiseNoWarningAndRepeatToTheByte) {
  const world::World world = without_cameras("parcel_cell");
  const world::Manifest manifest = draw(world, 30, 7);
  std::array<std::uint64_t, 2> digests{};
  for (std::uint64_t& digest : digests) {
    auto simulation = create(world, manifest, 7);
    simulation->advance_to(Time(from_s(30)));
    const auto health = simulation->health();
    EXPECT_TRUE(health) << health.error().line();
    EXPECT_GT(simulation->offered(), 5);
    EXPECT_LT(Truth(*simulation).arms().front().worst_speed_ratio, 0.01) << "the brakes hold";
    digest = simulation->state_digest();
  }
  EXPECT_EQ(digests[0], digests[1]);
  auto other = create(world, manifest, 8);
  other->advance_to(Time(from_s(20)));
  EXPECT_NE(other->state_digest(), digests[0]);
}

TEST(Simulation, StepsDoNotDependOnHowTimeIsAskedFor) {
  const world::World world = without_cameras("parcel_cell");
  const world::Manifest manifest = draw(world, 10, 7);
  auto coarse = create(world, manifest, 7), fine = create(world, manifest, 7);
  coarse->advance_to(Time(from_s(2)));
  for (int i = 1; i <= 2000; ++i) fine->advance_to(Time(from_s(1e-3 * i)));
  EXPECT_EQ(coarse->state_digest(), fine->state_digest());
}

TEST(Simulation, StopInputReachesTheSensors) {
  auto simulation = create(without_cameras("parcel_cell"), one_box(1.0), 3);
  body::Sensors sensors;
  simulation->press_stop(true);
  simulation->body().read(sensors);
  EXPECT_TRUE(sensors.stop_input);
  simulation->press_stop(false);
  simulation->body().read(sensors);
  EXPECT_FALSE(sensors.stop_input);
}

TEST(Simulation, PhotoEyeSeesEachParcelPassOnce) {
  auto simulation = create(without_cameras("parcel_cell"), one_box(1.0), 3);
  int edges = 0;
  bool last = false;
  for (int i = 1; i <= 6000; ++i) {
    simulation->advance_to(Time(from_s(1e-3 * i)));
    body::Sensors sensors;
    simulation->body().read(sensors);
    if (sensors.photo_eye_blocked && !last) ++edges;
    last = sensors.photo_eye_blocked;
  }
  EXPECT_EQ(edges, 1);
  EXPECT_FALSE(last);
}

TEST(Compose, NamesTheFileThatIsMissingOrBroken) {
  world::World world = without_cameras("parcel_cell");
  world.scene_mjcf = "worlds/parcel_cell/no_such.xml";
  auto missing = Simulation::create(world, one_box(1), 1);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().where, "worlds/parcel_cell/no_such.xml");
  world = without_cameras("parcel_cell");
  world.robot.flange_link = "no_such_link";
  auto link = Simulation::create(world, one_box(1), 1);
  ASSERT_FALSE(link);
  EXPECT_NE(link.error().what.find("no_such_link"), std::string::npos);
}

// The arm at home, the belt stopped as soon as the one box on it is within reach.
struct Bench {
  explicit Bench(double mass_kg)
      : world(without_cameras("parcel_cell")), cell(world, one_box(mass_kg), composed(world), 3), puppet(cell) {
    for (Eigen::Index i = 0; i < world.robot.home.size(); ++i) {
      cell.data->qpos[cell.arm().composed.qpos[static_cast<std::size_t>(i)]] = world.robot.home[i];
    }
    mj_forward(cell.composed.model.get(), cell.data.get());
    puppet.hold(0.002);
    const double* at = cell.data->qpos + cell.composed.slots[0].qpos;
    for (int i = 0; i < 40 && at[0] < -0.1; ++i) puppet.hold(0.2);
    world::Belt still = world.belt;
    still.speed_m_s = 0;
    cell.belt = BeltDrive(still, 1);
    puppet.hold(0.3);
    top = Vector3(at[0], at[1], at[2] + 0.5 * one_box(1)[0].size_m.z());
  }

  static Composed composed(const world::World& world) {
    auto composed = compose(world);
    if (!composed) throw std::runtime_error(composed.error().line());
    return std::move(*composed);
  }
  [[nodiscard]] const ParcelTruth& truth() const { return cell.ledger.parcels()[0]; }

  world::World world;
  Cell cell;
  Puppet puppet;
  Vector3 top = Vector3::Zero();  // middle of the box's top
};

class Lift : public testing::TestWithParam<double> {};

TEST_P(Lift, CupsSealCarryAndReleaseIntoAChute) {
  const double mass = GetParam();
  Bench bench(mass);
  const auto& [world, cell, puppet, top] = bench;
  bench.puppet.move_tip(top + Vector3(0, 0, 0.05), 1.0, 0.2);
  EXPECT_LT(cell.arm().measured.cup_vacuum_kpa[0], 2.0);
  bench.puppet.set_vacuum(0xf);
  bench.puppet.hold(0.2);
  EXPECT_NEAR(cell.arm().measured.cup_vacuum_kpa[0], 8.0, 2.0) << "open cups draw little";
  bench.puppet.move_tip(top - Vector3(0, 0, 0.004), 0.6, 0.3);
  for (std::size_t cup = 0; cup < 4; ++cup) EXPECT_GT(cell.arm().measured.cup_vacuum_kpa[cup], 50.0) << cup;
  bench.puppet.move_tip(top + Vector3(0, 0, 0.20), 0.8, 0.5);
  const ParcelTruth& truth = bench.truth();
  EXPECT_EQ(truth.where, Whereabouts::kHeld);
  EXPECT_EQ(truth.picks, 1);
  EXPECT_NEAR(cell.arm().measured.wrist_force_n[2], (world.robot.tool.mass_kg + mass) * 9.81, 0.8 + 0.02 * mass * 9.81);

  bench.puppet.move_tip(world.place("chute_2")->center_m + Vector3(0, 0, 0.22), 1.5, 0.2);
  EXPECT_EQ(truth.where, Whereabouts::kHeld);
  bench.puppet.set_vacuum(0);
  bench.puppet.hold(1.0);
  EXPECT_EQ(truth.where, Whereabouts::kChute);
  EXPECT_EQ(truth.place, "chute_2");
  EXPECT_EQ(truth.drops, 0);
  EXPECT_GT(truth.max_drop_m, 0.35);
  EXPECT_LT(truth.max_drop_m, world.rules.max_drop_m);
  EXPECT_LT(truth.max_press_n, world.rules.max_press_n);
  EXPECT_GT(truth.max_press_n, 0);
  EXPECT_LT(cell.ledger.arms().front().worst_speed_ratio, 1.0);
  for (const mjWarningStat& warning : cell.data->warning) EXPECT_EQ(warning.number, 0);
}

INSTANTIATE_TEST_SUITE_P(Masses, Lift, testing::Values(0.3, 1.5, 3.5));

// Or lies on the rim, maybe, and falls into another mouth.
TEST(Curtain, WhatHangsInItHasNotFallenIn) {
  Bench bench(1.0);
  const world::Place& chute = *bench.world.place("chute_2");
  const auto counted = [&, place = static_cast<std::size_t>(&chute - bench.world.places.data())] {
    return bench.cell.arm().measured.fallen_into[place];
  };
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.1);
  bench.puppet.set_vacuum(0xf);
  bench.puppet.move_tip(bench.top - Vector3(0, 0, 0.004), 0.6, 0.3);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.30), 0.8, 0.2);
  bench.puppet.move_tip(chute.center_m + Vector3(0, 0, 0.30), 1.5, 0.2);
  bench.puppet.move_tip(chute.center_m + Vector3(0, 0, 0.05), 1.0, 0.5);
  ASSERT_EQ(bench.truth().where, Whereabouts::kHeld);
  EXPECT_EQ(counted(), 0);
  bench.puppet.set_vacuum(0);
  bench.puppet.hold(0.5);
  EXPECT_EQ(counted(), 1);
}

TEST(Truth, AJointBeyondItsLimitIsToldWithItsTime) {
  Bench bench(1.0);
  const ArmTruth& arm = bench.cell.ledger.arms().front();
  const auto too_quick = [&] {
    std::vector<Breach> breaches = arm.breaches;
    std::erase_if(breaches, [](const Breach& each) { return each.of != Breach::Of::kSpeed; });
    return breaches;
  };
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.2);
  EXPECT_TRUE(too_quick().empty());
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.20), 0.06, 0.2);
  EXPECT_GT(arm.speed_violations, 0U);
  const std::vector<Breach> breaches = too_quick();
  ASSERT_FALSE(breaches.empty());
  const auto worst = std::ranges::max_element(breaches, {}, &Breach::worst_ratio);
  EXPECT_DOUBLE_EQ(worst->worst_ratio, arm.worst_speed_ratio);
  for (const Breach& breach : breaches) {
    EXPECT_LE(breach.from, breach.to);
    EXPECT_LT(breach.to, breach.from + from_s(0.35)) << "it has stopped since";
  }
}

TEST(Truth, AParcelLostUnderVacuumIsADrop) {
  Bench bench(1.0);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.1);
  bench.puppet.set_vacuum(0xf);
  bench.puppet.move_tip(bench.top - Vector3(0, 0, 0.004), 0.6, 0.3);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.20), 0.8, 0.2);
  ASSERT_EQ(bench.truth().where, Whereabouts::kHeld);
  for (const sim::Cup& cup : bench.cell.arm().composed.cups) {
    bench.cell.composed.model->actuator_gainprm[mjNGAIN * cup.actuator] = 0;
  }
  bench.puppet.hold(2.0);
  EXPECT_EQ(bench.truth().drops, 1);
  EXPECT_EQ(bench.truth().where, Whereabouts::kBelt);
  EXPECT_NEAR(bench.truth().max_drop_m, 0.20, 0.02);
}

// As long as an arm holds it that waits for its next bridge, or for a person.
TEST(Truth, WhatHangsStillForLongAndIsThenLetGoOfIsNoStray) {
  Bench bench(1.0);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.1);
  bench.puppet.set_vacuum(0xf);
  bench.puppet.move_tip(bench.top - Vector3(0, 0, 0.004), 0.6, 0.3);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.20), 0.8, 0.2);
  bench.puppet.move_tip(bench.world.place("chute_2")->center_m + Vector3(0, 0, 0.22), 1.5, 12.0);
  ASSERT_EQ(bench.truth().where, Whereabouts::kHeld);
  bench.puppet.set_vacuum(0);
  bench.puppet.hold(1.0);
  EXPECT_EQ(bench.truth().where, Whereabouts::kChute);
  EXPECT_EQ(bench.truth().place, "chute_2");
}

TEST(Truth, WhatFallsBesideLiesInTheTrayForTheCameraAndIsCleared) {
  Bench bench(1.0);
  double* at = bench.cell.data->qpos + bench.cell.composed.slots[0].qpos;
  at[0] = -0.8;
  at[1] = 0.6;
  bench.puppet.hold(2.0);
  EXPECT_EQ(bench.truth().where, Whereabouts::kTray);
  EXPECT_EQ(bench.truth().place, "tray");
  EXPECT_GT(bench.truth().max_drop_m, bench.world.rules.max_drop_m);
  EXPECT_EQ(bench.truth().drops, 0);
  bench.puppet.hold(3.0);
  ASSERT_GE(bench.cell.ledger.slot_of(0), 0) << "the tray's camera has time to see it";
  bench.puppet.hold(4.0);
  EXPECT_LT(bench.cell.ledger.slot_of(0), 0);
}

TEST(Truth, PushingHardWithTheToolIsRecorded) {
  Bench bench(1.0);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.1);
  bench.puppet.move_tip(bench.top - Vector3(0, 0, 0.040), 1.0, 0.3);
  EXPECT_GT(bench.truth().max_press_n, bench.world.rules.max_press_n) << "the bellows are at their stops";
  EXPECT_EQ(bench.truth().picks, 0);
}

TEST(Simulation, DrivesHaveTheRotorsOfTheWorldsFile) {
  world::World world = without_cameras("small_cell");
  world.robot.rotor_inertia_kg_m2 << 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1;
  const auto composed = compose(world);
  ASSERT_TRUE(composed);
  for (Eigen::Index axis = 0; axis < 7; ++axis) {
    const int dof = composed->arms.front().dof[static_cast<std::size_t>(axis)];
    EXPECT_EQ(composed->model->dof_armature[dof], world.robot.rotor_inertia_kg_m2[axis]) << axis;
  }
}

// Told to let go of its brakes, an arm begins to fall so much later.
TEST(Simulation, SetPointsActAfterTheDriveDelay) {
  const auto falls_at_ms = [](double delay_s) {
    world::World world = without_cameras("parcel_cell");
    world.robot.drive_delay_s = delay_s;
    auto simulation = create(world, one_box(1.0), 3);
    body::SetPoints told{.torque_nm = AxisVector::Zero(6)};
    body::Sensors sensors;
    for (int ms = 1; ms < 200; ++ms) {
      simulation->advance_to(Time(std::chrono::milliseconds(ms)));
      simulation->body().read(sensors);
      if (ms > 100 && sensors.speed.cwiseAbs().maxCoeff() > 0.02) return ms;  // it sags a little into its brakes first
      told.power = ms >= 100;
      simulation->body().write(told);
    }
    return 0;
  };
  const int at_once = falls_at_ms(0);
  EXPECT_GT(at_once, 101);
  EXPECT_EQ(falls_at_ms(0.004), at_once + 4);
  EXPECT_EQ(falls_at_ms(0.010), at_once + 10);
}

// Braked as if the other joints stood at once, one that is light was thrown by them, to 119 % here; and by what the
// brakes do not know of, a force as a load's weight, the arm crept on for ever.
TEST(Simulation, BrakesBringDownAnArmInSwingAndThenHoldIt) {
  auto simulation = create(without_cameras("parcel_cell"), one_box(1.0), 3);
  body::Sensors sensors;
  Time now;
  const auto fastest = [&] { return sensors.speed.cwiseAbs().maxCoeff(); };
  const auto run = [&](const body::SetPoints& told, int ms) {
    double most = 0;
    for (int i = 0; i < ms; ++i) {
      simulation->body().write(told);
      simulation->advance_to(now += std::chrono::milliseconds(1));
      simulation->body().read(sensors);
      most = std::max(most, fastest());
    }
    return most;
  };
  simulation->push_tip({0, 0, -20});
  body::SetPoints told{.torque_nm = AxisVector::Zero(6), .power = true};
  told.torque_nm.head(4) << 60, -100, -100, -10;
  (void)run(told, 50);
  const double swings = fastest();
  EXPECT_GT(swings, 4.0);
  told.power = false;
  EXPECT_LE(run(told, 300), 1.01 * swings);
  (void)run(told, 500);
  const AxisVector stands = sensors.position;
  EXPECT_LT(run(told, 2000), 1e-3);
  EXPECT_LT((sensors.position - stands).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Simulation, TheSmallWorldRunsToo) {
  const world::World world = without_cameras("small_cell");
  auto simulation = create(world, draw(world, 6, 2), 2);
  simulation->advance_to(Time(from_s(15)));
  EXPECT_TRUE(simulation->health());
  body::Sensors sensors;
  simulation->body().read(sensors);
  EXPECT_EQ(sensors.position.size(), 7);
  EXPECT_LT((sensors.position - world.robot.home).norm(), 1e-3);
  EXPECT_GT(simulation->offered(), 1);
}

}  // namespace
}  // namespace pons::sim
