// What a plan of faults does to body and cameras, and that it does nothing else.
#include "pons/sim/faults.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "pons/sim/cell.hpp"
#include "pons/sim/puppet.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

using world::Fault;

world::World load_cell() {
  auto world = world::load("worlds", "parcel_cell");
  if (!world) throw std::runtime_error(world.error().line());
  return *world;
}

world::World without_cameras() {
  world::World world = load_cell();
  world.cameras.clear();
  return world;
}

world::Manifest boxes(int count) {
  world::Manifest manifest;
  for (int i = 0; i < count; ++i) {
    world::ManifestRow row;
    row.parcel_id = "P00000" + std::string(1, static_cast<char>('1' + i));
    row.destination = "chute_2";
    row.size_m = Vector3(0.24, 0.18, 0.12);
    row.mass_kg = 0.6;
    manifest.push_back(row);
  }
  return manifest;
}

world::FaultPlan only(Fault fault, const world::FaultRate& rate) {
  world::FaultPlan plan{.name = "test"};
  plan.rates[static_cast<std::size_t>(fault)] = rate;
  return plan;
}

Composed composed(const world::World& world, const world::FaultPlan& plan) {
  auto composed = compose(world, plan);
  if (!composed) throw std::runtime_error(composed.error().line());
  return std::move(*composed);
}

// Boxes on a belt that stands, the first within reach; the arm at home.
struct Bench {
  explicit Bench(const world::FaultPlan& plan, int count = 1)
      : world(without_cameras()), cell(world, boxes(count), composed(world, plan), 3, plan), puppet(cell) {
    for (Eigen::Index i = 0; i < world.robot.home.size(); ++i)
      cell.data->qpos[cell.arm().composed.qpos[static_cast<std::size_t>(i)]] = world.robot.home[i];
    mj_forward(cell.composed.model.get(), cell.data.get());
    puppet.hold(0.002);
    for (int i = 0; i < 40 && at(0).x() < -0.1; ++i) puppet.hold(0.2);
    world::Belt still = world.belt;
    still.speed_m_s = 0;
    cell.belt = BeltDrive(still, 1);
    puppet.hold(0.3);
    top = at(0) + Vector3(0, 0, 0.06);
  }
  [[nodiscard]] Vector3 at(std::size_t slot) const {
    return Eigen::Map<const Vector3>(cell.data->qpos + cell.composed.slots[slot].qpos);
  }
  void touch() {
    puppet.move_tip(top + Vector3(0, 0, 0.05), 1.0, 0.1);
    puppet.set_vacuum(0xf);
    puppet.move_tip(top - Vector3(0, 0, 0.004), 0.6, 0.3);
  }
  void lift() { puppet.move_tip(top + Vector3(0, 0, 0.20), 0.8, 0.1); }
  [[nodiscard]] std::int64_t count(Fault fault) const { return cell.faults.counts()[fault]; }

  world::World world;
  Cell cell;
  Puppet puppet;
  Vector3 top = Vector3::Zero();  // middle of the first box's top
};

TEST(Faults, AMissedGraspDoesNotSealUntilTheNextAttempt) {
  Bench bench(only(Fault::kMissedGrasp, {.often = 1}));
  bench.touch();
  EXPECT_NEAR(bench.cell.arm().measured.cup_vacuum_kpa[0], 8, 2) << "like a cup that touches nothing";
  EXPECT_EQ(bench.count(Fault::kMissedGrasp), 1);
  bench.lift();
  EXPECT_EQ(bench.cell.ledger.parcels()[0].picks, 0);
  bench.puppet.set_vacuum(0);
  bench.puppet.hold(0.2);
  bench.touch();
  EXPECT_EQ(bench.count(Fault::kMissedGrasp), 2);
}

TEST(Faults, ALeakLeavesLessThanTheFullVacuum) {
  Bench bench(only(Fault::kWeakVacuum, {.often = 1}));
  bench.touch();
  EXPECT_GT(bench.cell.arm().measured.cup_vacuum_kpa[0], 15);
  EXPECT_LT(bench.cell.arm().measured.cup_vacuum_kpa[0], 47);
  EXPECT_EQ(bench.count(Fault::kWeakVacuum), 1);
}

TEST(Faults, ADropLosesTheSealOnTheWay) {
  Bench bench(only(Fault::kDrop, {.often = 1}));
  bench.touch();
  bench.lift();
  EXPECT_EQ(bench.cell.ledger.parcels()[0].picks, 1);
  bench.puppet.hold(1.3);
  EXPECT_EQ(bench.cell.ledger.parcels()[0].drops, 1);
  EXPECT_EQ(bench.count(Fault::kDrop), 1);
}

// The second is moved beside the first, touches it, and comes along until the first is let go of.
TEST(Faults, ANeighbourClingsUntilItIsLetGoOf) {
  Bench bench(only(Fault::kDoublePick, {.often = 1}), 2);
  for (int i = 0; i < 60 && bench.cell.feeder.offered() < 2; ++i) bench.puppet.hold(0.2);
  ASSERT_EQ(bench.cell.feeder.offered(), 2);
  const Slot &one = bench.cell.composed.slots[0], &two = bench.cell.composed.slots[1];
  Pose beside = from_mujoco(bench.cell.data->qpos + one.qpos, bench.cell.data->qpos + one.qpos + 3);
  beside.translate(Vector3(0.245, 0, 0));
  to_mujoco(beside, bench.cell.data->qpos + two.qpos, bench.cell.data->qpos + two.qpos + 3);
  bench.puppet.hold(0.2);
  bench.touch();
  bench.lift();
  EXPECT_EQ(bench.count(Fault::kDoublePick), 1);
  EXPECT_GT(bench.at(1).z(), bench.world.belt.surface_z_m + 0.15) << "it rises with the first";
  EXPECT_NEAR((bench.at(1) - bench.at(0)).norm(), 0.245, 0.02);
  bench.puppet.set_vacuum(0);
  bench.puppet.hold(0.5);
  EXPECT_EQ(bench.cell.data->eq_active[bench.cell.composed.cling], 0);
  EXPECT_LT(bench.at(1).z(), bench.world.belt.surface_z_m + 0.15);
  for (const mjWarningStat& warning : bench.cell.data->warning) EXPECT_EQ(warning.number, 0);
}

TEST(Faults, WithoutANeighbourNothingClings) {
  Bench bench(only(Fault::kDoublePick, {.often = 1}));
  bench.touch();
  bench.lift();
  EXPECT_EQ(bench.count(Fault::kDoublePick), 0);
}

std::unique_ptr<Simulation> create(const world::World& world, const world::FaultPlan& plan, int count = 1) {
  auto simulation = Simulation::create(world, boxes(count), 5, plan);
  if (!simulation) throw std::runtime_error(simulation.error().line());
  (*simulation)->run_belt();
  return std::move(*simulation);
}

double travel_m(Simulation& simulation, double seconds) {
  body::Sensors sensors;
  for (int tick = 0; tick < static_cast<int>(100 * seconds); ++tick) {
    simulation.run_belt();  // as often as a loop would
    simulation.advance_to(Time(from_s(0.01 * (tick + 1))));
  }
  simulation.body().read(sensors);
  return sensors.belt_travel_m;
}

TEST(Faults, AJammedBeltStandsThoughToldToRun) {
  const world::World world = without_cameras();
  auto free = create(world, {}),
       jams = create(world, only(Fault::kBeltJam, {.often = 400, .shortest_s = 5, .longest_s = 6}));
  const double whole_m = travel_m(*free, 60), jammed_m = travel_m(*jams, 60);
  const auto times = static_cast<double>(jams->faults()[Fault::kBeltJam]);
  ASSERT_GE(times, 1);
  EXPECT_LT(jammed_m, whole_m - (times - 1) * 4 * world.belt.speed_m_s * (1 - world.belt.speed_variation));
  EXPECT_LT(jammed_m, 0.97 * whole_m);
}

// From soon after the beginning, for all of the test.
constexpr world::FaultRate kAlways{.often = 3600, .shortest_s = 500, .longest_s = 600, .by_m = 0.03};

class Sights : public testing::Test {
 protected:
  world::World world_ = load_cell();
};

TEST_F(Sights, ABlackoutIsBlackAndHasNoDepth) {
  auto simulation = create(world_, only(Fault::kBlackout, kAlways));
  for (int s = 1; s < 30; ++s) {
    simulation->cameras()[0]->begin(Time(from_s(s)));
    RgbdFrame frame;
    ASSERT_TRUE(simulation->cameras()[0]->finish(frame));
    if (simulation->faults()[Fault::kBlackout] == 0) continue;
    EXPECT_TRUE(std::ranges::all_of(frame.rgb, [](std::uint8_t value) { return value == 0; }));
    EXPECT_TRUE(std::ranges::all_of(frame.depth_m, [](float depth) { return depth == 0; }));
    return;
  }
  FAIL() << "no blackout came";
}

TEST_F(Sights, WhatHidesAPartIsNearAndTheRestIsAsEver) {
  auto plain = create(world_, {}), hidden = create(world_, only(Fault::kOcclusion, kAlways));
  for (int s = 1; s < 30; ++s) {
    RgbdFrame one, two;
    plain->cameras()[0]->begin(Time(from_s(s)));
    hidden->cameras()[0]->begin(Time(from_s(s)));
    ASSERT_TRUE(plain->cameras()[0]->finish(one));
    ASSERT_TRUE(hidden->cameras()[0]->finish(two));
    if (hidden->faults()[Fault::kOcclusion] == 0) continue;
    std::size_t near = 0, same = 0;
    for (std::size_t i = 0; i < one.depth_m.size(); ++i) {
      near += two.depth_m[i] == 0.5F ? 1U : 0U;
      same += two.depth_m[i] == one.depth_m[i] ? 1U : 0U;
    }
    const double share = static_cast<double>(near) / static_cast<double>(one.depth_m.size());
    EXPECT_GT(share, 0.15 * 0.29);
    EXPECT_LT(share, 0.46);
    EXPECT_EQ(near + same, one.depth_m.size());
    return;
  }
  FAIL() << "nothing came before the camera";
}

TEST_F(Sights, AShiftedViewIsShiftedInBothStreamsAndSaysNothing) {
  auto plain = create(world_, {}), shifted = create(world_, only(Fault::kShiftedView, kAlways));
  for (int s = 1; s < 30; ++s) {
    RgbdFrame one, two;
    plain->cameras()[0]->begin(Time(from_s(s)));
    shifted->cameras()[0]->begin(Time(from_s(s)));
    ASSERT_TRUE(plain->cameras()[0]->finish(one));
    ASSERT_TRUE(shifted->cameras()[0]->finish(two));
    if (shifted->faults()[Fault::kShiftedView] == 0) {
      EXPECT_TRUE(std::ranges::equal(one.depth_m, two.depth_m));
      continue;
    }
    EXPECT_FALSE(std::ranges::equal(one.depth_m, two.depth_m));
    EXPECT_TRUE(one.world_from_optical.isApprox(two.world_from_optical));
    return;
  }
  FAIL() << "no shift came";
}

TEST(Faults, SecondLabelsComeInTheirShareWhereThereIsRoom) {
  const world::World world = without_cameras();
  const auto manifest = world::draw_manifest(world, 4000, 3);
  ASSERT_TRUE(manifest);
  const std::vector<Arrival> before = plan_arrivals(world, *manifest, 3);
  std::vector<Arrival> after = before;
  const auto plan = only(Fault::kDoubleLabel, {.often = 0.3});
  Faults(plan, 3).add_labels(world, *manifest, after);
  int could = 0, twice = 0, own = 0;
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i].label_text, before[i].label_text);
    EXPECT_TRUE(after[i].group_from_middle.isApprox(before[i].group_from_middle));
    could += before[i].label == LabelState::kReadable ? 1 : 0;
    if (after[i].second_text.empty()) continue;
    EXPECT_EQ(after[i].label, LabelState::kReadable);
    EXPECT_GT((*manifest)[i].size_m.x(), 2 * world.arrivals.label_m);
    ++twice;
    own += after[i].second_text == (*manifest)[i].parcel_id ? 1 : 0;
  }
  EXPECT_GT(twice, 0.2 * could);
  EXPECT_LT(twice, 0.33 * could);
  EXPECT_NEAR(static_cast<double>(own) / twice, 0.5, 0.1);
}

// A plan without rates changes nothing, nor does one fault what the others draw.
TEST(Faults, WithoutRatesEveryByteIsAsEver) {
  const world::World world = without_cameras();
  auto plain = create(world, {}, 5), planned = create(world, {.name = "empty"}, 5);
  EXPECT_EQ(plain->faults().of, planned->faults().of);
  (void)travel_m(*plain, 20);
  (void)travel_m(*planned, 20);
  EXPECT_EQ(plain->state_digest(), planned->state_digest());
  auto labels = create(world, only(Fault::kMissedGrasp, {.often = 0.5}), 5);
  (void)travel_m(*labels, 20);
  EXPECT_EQ(plain->state_digest(), labels->state_digest()) << "nothing was picked";
}

TEST(Faults, PicksAreDrawnInTheirShare) {
  const world::FaultPlan plan = only(Fault::kMissedGrasp, {.often = 0.25});
  Bench bench(plan);
  Faults faults(plan, 11);
  bench.puppet.move_tip(bench.top + Vector3(0, 0, 0.05), 1.0, 0.1);
  bench.puppet.move_tip(bench.top - Vector3(0, 0, 0.004), 0.6, 0.3);
  ASSERT_GE(bench.cell.arm().gripper.touched(), 0);
  int missed = 0;
  for (int i = 0; i < 4000; ++i) {
    (void)faults.suction(0, 0, bench.cell.arm().gripper, bench.cell.ledger, Time{});
    missed += faults.suction(0, 0xf, bench.cell.arm().gripper, bench.cell.ledger, Time{}).seals ? 0 : 1;
  }
  EXPECT_NEAR(missed / 4000.0, 0.25, 0.03);
  EXPECT_EQ(faults.counts()[Fault::kMissedGrasp], missed);
}

}  // namespace
}  // namespace pons::sim
