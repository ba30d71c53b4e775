#include "pons/sim/bare_step.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "pons/sim/simulation.hpp"

namespace pons::sim {
namespace {

class BareStepTest : public ::testing::Test {
 protected:
  static world::World load() {
    auto world = world::load("worlds", "parcel_cell");
    if (!world) throw std::runtime_error(world.error().line());
    world->cameras.clear();
    return *world;
  }
  static std::unique_ptr<Simulation> create(const world::World& world, const world::Manifest& manifest) {
    auto simulation = Simulation::create(world, manifest, 1);
    if (!simulation) throw std::runtime_error(simulation.error().line());
    return std::move(*simulation);
  }
  [[nodiscard]] body::SetPoints torque(double nm) const {
    return {.torque_nm = AxisVector::Constant(world_.robot.home.size(), nm), .vacuum_on = 0, .power = true};
  }

  world::World world_ = load();
};

// Without parcels nothing but the arm moves, and of that the copy leaves nothing out.
TEST_F(BareStepTest, TakesTheSameStepsFromTheSameStateWithTheSameSetPoints) {
  const auto simulation = create(world_, {});
  simulation->body().write(torque(5));
  simulation->advance_to(Time(from_s(0.02)));
  BareStep bare(*simulation);
  EXPECT_EQ(bare.state_digest(), simulation->state_digest());

  simulation->body().write(torque(-5));
  bare.write(torque(-5));
  simulation->advance_to(Time(from_s(0.04)));
  EXPECT_NE(bare.state_digest(), simulation->state_digest()) << "it moves only when it is told to";
  bare.advance_to(Time(from_s(0.04)));
  EXPECT_EQ(bare.state_digest(), simulation->state_digest());
}

TEST_F(BareStepTest, CopyBringsItBackToItsOriginal) {
  const auto manifest = world::draw_manifest(world_, 3, 1);
  ASSERT_TRUE(manifest);
  const auto simulation = create(world_, *manifest);
  BareStep bare(*simulation);
  bare.write(torque(5));
  bare.advance_to(Time(from_s(0.02)));
  EXPECT_NE(bare.state_digest(), simulation->state_digest());
  simulation->run_belt();
  simulation->advance_to(Time(from_s(3)));
  ASSERT_GT(simulation->offered(), 0) << "the feeder rewrote a spare parcel's size and mass";
  bare.copy();
  EXPECT_EQ(bare.state_digest(), simulation->state_digest());
}

}  // namespace
}  // namespace pons::sim
