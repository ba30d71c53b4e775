// The control laws are functions of what they are handed: whatever else was calculated with the same model, equal
// arguments give equal torques and equal memories, to the last bit.
#include "pons/cerebellum/computed_torque.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "pons/cerebellum/compliance.hpp"
#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

AxisVector any(Random& random, double most) {
  AxisVector values = bench_robot().home;
  for (auto& value : values) value = random.uniform(-most, most);
  return values;
}

AxisState any_state(Random& random) { return {bench_robot().home + any(random, 0.5), any(random, 1), any(random, 5)}; }

// Everything that a law is handed, memories included.
struct Arguments {
  AxisVector position, speed;
  model::Payload payload{.mass_kg = 1.2, .com_m = {0.01, 0.02, 0.1}};
  AxisState commanded, acting;
  Vector6 felt;
  link::Compliance compliance;
  Corrections corrections{bench_robot().home.size(), 3};
  Admittance admittance;
  AxisState reference;

  explicit Arguments(Random& random)
      : position(any_state(random).position),
        speed(any(random, 1)),
        commanded(any_state(random)),
        acting(any_state(random)),
        felt(Vector6::Constant(random.uniform(1, 10))) {
    compliance.stiffness = {500, 500, 500, 20, 20, 20};
    compliance.damping = {100, 100, 100, 5, 5, 5};
    compliance.force_max_n = 100;
    corrections.integral = any(random, 50);
    for (int i = 0; i < 4; ++i) corrections.sent.push(any(random, 50));
    admittance.axis_way = any(random, 0.01);
    admittance.axis_speed = any(random, 0.1);
    admittance.speed.setConstant(random.uniform(0, 0.02));
  }
  [[nodiscard]] ArmNow arm() const { return {position, speed, payload}; }
};

using Law = std::function<void(model::RobotModel&, Arguments&, AxisVector& torque_nm)>;

struct LawCase {
  const char* name;
  Law law;
};

class Laws : public testing::TestWithParam<LawCase> {};

void expect_equal(const Arguments& one, const Arguments& other) {
  EXPECT_EQ(one.corrections.integral, other.corrections.integral);
  for (std::size_t ago = 0; ago <= one.corrections.sent.ticks(); ++ago)
    EXPECT_EQ(one.corrections.sent.before(ago), other.corrections.sent.before(ago));
  EXPECT_EQ(one.admittance.speed, other.admittance.speed);
  EXPECT_EQ(one.admittance.way, other.admittance.way);
  EXPECT_EQ(one.admittance.axis_way, other.admittance.axis_way);
  EXPECT_EQ(one.admittance.axis_speed, other.admittance.axis_speed);
}

TEST_P(Laws, AreFunctionsOfWhatTheyAreHanded) {
  Random random(7);
  model::RobotModel model = bench_model();
  const Law& law = GetParam().law;
  for (int i = 0; i < 100; ++i) {
    const Arguments given(random);
    Arguments first = given, between(random), second = given;
    AxisVector torque, other, again;
    law(model, first, torque);
    law(model, between, other);
    law(model, second, again);
    EXPECT_EQ(torque, again);
    EXPECT_NE(torque, other);
    expect_equal(first, second);
  }
}

INSTANTIATE_TEST_SUITE_P(All, Laws,
                         testing::Values(LawCase{"ComputedTorque",
                                                 [](auto& model, auto& is, auto& torque_nm) {
                                                   computed_torque(model, {}, is.arm(), is.commanded, is.acting, 1e-3,
                                                                   is.corrections, torque_nm);
                                                 }},
                                         LawCase{"FeedForward",
                                                 [](auto& model, auto& is, auto& torque_nm) {
                                                   feed_forward(model, is.commanded, is.payload, is.corrections,
                                                                torque_nm);
                                                 }},
                                         LawCase{"GiveWay",
                                                 [](auto& model, auto& is, auto& torque_nm) {
                                                   give_way(model, {}, is.arm(), is.corrections, torque_nm);
                                                 }},
                                         LawCase{"Impedance",
                                                 [](auto& model, auto& is, auto& torque_nm) {
                                                   impedance(model, is.compliance, {}, is.arm(), is.commanded,
                                                             torque_nm);
                                                 }},
                                         LawCase{"Admittance",
                                                 [](auto& model, auto& is, auto& torque_nm) {
                                                   admittance(model, is.compliance, {}, {bench_robot().limits},
                                                              is.commanded, is.felt, 1e-3, is.admittance, is.reference);
                                                   computed_torque(model, {}, is.arm(), is.reference, is.acting, 1e-3,
                                                                   is.corrections, torque_nm);
                                                 }}),
                         [](const auto& c) { return std::string(c.param.name); });

// At the commanded place, with nothing to correct, only the model speaks; an error is answered at once, by its gain.
TEST(ComputedTorque, IsInverseDynamicsAndTheGains) {
  Random random(3);
  model::RobotModel model = bench_model();
  const AxisState commanded = any_state(random);
  const model::Payload payload;
  Corrections corrections(commanded.position.size(), 0);
  AxisVector exact, torque;
  model.inverse_dynamics(commanded.position, commanded.speed, commanded.acceleration, payload, exact);
  computed_torque(model, {}, {commanded.position, commanded.speed, payload}, commanded, commanded, 1e-3, corrections,
                  torque);
  EXPECT_EQ(torque, exact);

  const Gains gains{.integral_1_s3 = 0};
  AxisVector off = commanded.position;
  off[2] -= 1e-3;
  AxisVector asked = commanded.acceleration;
  asked[2] += 1e-3 * gains.position_1_s2;
  model.inverse_dynamics(commanded.position, commanded.speed, asked, payload, exact);
  computed_torque(model, gains, {off, commanded.speed, payload}, commanded, commanded, 1e-3, corrections, torque);
  EXPECT_LT((torque - exact).cwiseAbs().maxCoeff(), 1e-9);
}

// A blow throws a wrist to several times its speed limit: nothing is gained by letting it spin.
TEST(GiveWay, BrakesGentlyAndWhatIsFastTheHarder) {
  model::RobotModel model = bench_model();
  const Gains gains;
  const AxisLimits& limits = bench_robot().limits;
  const AxisVector& most = limits.acceleration_rad_s2;
  Corrections corrections(6, 0);
  AxisVector speed = AxisVector::Zero(6), wanted = speed, torque, exact;
  speed[0] = 0.01, wanted[0] = -gains.brake_1_s * speed[0];
  speed[1] = -0.7 * limits.speed_rad_s[1], wanted[1] = most[1];
  speed[3] = -0.85 * limits.speed_rad_s[3], wanted[3] = 3 * most[3];
  speed[4] = 2.5 * limits.speed_rad_s[4], wanted[4] = -5 * most[4];
  speed[5] = limits.speed_rad_s[5], wanted[5] = -5 * most[5];
  const AxisVector& at = bench_robot().home;
  give_way(model, gains, {at, speed, {}}, corrections, torque);
  model.inverse_dynamics(at, speed, wanted, {}, exact);
  EXPECT_LT((torque - exact).cwiseAbs().maxCoeff(), 1e-9);
}

// What cannot be corrected winds the integral up to its bound and no further; forgotten, it starts from nothing.
TEST(ComputedTorque, BoundsItsIntegral) {
  model::RobotModel model = bench_model();
  const AxisState commanded = at_rest(bench_robot().home);
  const AxisVector off = commanded.position.array() - 0.1;
  const model::Payload payload;
  Corrections corrections(off.size(), 2);
  AxisVector torque;
  for (int tick = 0; tick < 1000; ++tick)
    computed_torque(model, {}, {off, commanded.speed, payload}, commanded, commanded, 1e-3, corrections, torque);
  EXPECT_EQ(corrections.integral, AxisVector::Constant(off.size(), Gains{}.integral_max_rad_s2));
  corrections.forget();
  EXPECT_EQ(corrections.integral, AxisVector::Zero(off.size()));
  EXPECT_EQ(corrections.sent.out(), AxisVector::Zero(off.size()));
}

}  // namespace
}  // namespace pons::cerebellum
