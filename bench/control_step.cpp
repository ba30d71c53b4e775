// What a whole control step costs (commands, sample of the motion, every limit, safety machine, observer, wrist,
// dynamics: all that Cerebellum::step does), of both worlds' arms in full motion, each step with a new measurement.
// Beside it, taking turns in the same run and on the same states, what Pinocchio's recursive Newton-Euler alone costs.
// Caches are warm, as they are not in a loop that sleeps between its steps.
//
// usage: control_step [--gate] [ROUNDS (9)]      --gate: exit 1 where the bar is missed

#include <fmt/format.h>

#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "apps/paths.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/motion/motion.hpp"
#include "pons/rt/clock.hpp"
#include "pons/skills/arm.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;
using namespace std::chrono_literals;

constexpr double kBarMedian_us = 10;    // seven axes
constexpr int kStepsPerRound = 10'000;  // in motion: ten seconds of an arm's life
constexpr double kWay_rad = 0.8;

[[noreturn]] void give_up(const Error& error) {
  fmt::print(stderr, "control_step: {}\n", error.line());
  std::exit(2);
}

template <typename T>
T must(Expected<T> result) {
  if (!result) give_up(result.error());
  return std::move(*result);
}

// Of values in any order; `share` from 0 to 1.
double percentile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

double median(std::vector<double> values) { return percentile(std::move(values), 0.5); }

// What reading the clock twice says when nothing was done between; taken off what is timed.
double clock_cost_us(const rt::MonotonicClock& clock) {
  std::vector<double> took_us;
  for (int i = 0; i < 100'000; ++i) {
    const Time begin = clock.now();
    took_us.push_back(1e6 * to_s(clock.now() - begin));
  }
  return median(std::move(took_us));
}

// A cerebellum, the bridge's hand that sends it to and fro, and an arm that does as it is told.
class Loop {
 public:
  explicit Loop(const world::World& world)
      : world_(world), cerebellum_(must(model::RobotModel::load(world.robot)), {}, Time{}), arm_(bridge_, world) {
    arm_.payload(1, Vector3(0, 0, 0.2));
    while (!arm_.operational()) {
      if (now_.ns() % 10'000'000 == 0) arm_.refresh(now_), arm_.arm(now_);
      follow();
      step();
    }
  }

  // Times so many steps in motion, and notes the states that they commanded.
  void round(const rt::MonotonicClock& clock, std::vector<double>& took_us, std::vector<AxisState>& states) {
    while (states.size() < static_cast<std::size_t>(kStepsPerRound)) {
      if (now_.ns() % 10'000'000 == 0) bridge();
      follow();
      const Time begin = clock.now();
      step();
      const Time end = clock.now();
      if (cerebellum_.state().safety != link::SafetyState::kOperational)
        give_up({"the arm stopped", world_.robot.name, std::string(name(cerebellum_.state().cause))});
      if (cerebellum::is_at_rest(cerebellum_.state().commanded)) continue;
      took_us.push_back(1e6 * to_s(end - begin));
      states.push_back(cerebellum_.state().commanded);
    }
  }

 private:
  // The arm is where it was asked to be.
  void follow() {
    now_ += 1ms;
    const AxisState there = arm_.planned(now_);
    sensors_.stamp = now_;
    sensors_.position = there.position;
    sensors_.speed = there.speed;
  }

  void step() { cerebellum_.step(now_, sensors_, end_, set_points_); }

  void bridge() {
    arm_.refresh(now_);
    if (now_ < arm_.motion_end()) return;
    AxisVector target = world_.robot.home;
    target.array() += std::exchange(there_, !there_) ? kWay_rad / 2 : -kWay_rad / 2;
    const AxisLimits& limits = world_.robot.limits;
    target = target.cwiseMax(limits.position_min).cwiseMin(limits.position_max);
    const Time from = arm_.splice_time(now_);
    const auto way = must(motion::move(arm_.planned(from), from, {target, AxisVector::Zero(target.size())}, limits));
    if (const auto sent = arm_.stream(way); !sent) give_up(sent.error());
  }

  const world::World& world_;
  const std::unique_ptr<link::Link> link_ = std::make_unique<link::Link>();
  link::BridgeEnd bridge_{*link_};
  link::CerebellumEnd end_{*link_};
  cerebellum::Cerebellum cerebellum_;
  skills::Arm arm_;
  body::Sensors sensors_;
  body::SetPoints set_points_;
  Time now_;
  bool there_ = false;
};

// Pinocchio's recursive Newton-Euler on the arm's URDF; sums what comes out, so that it must be reckoned.
class NewtonEuler {
 public:
  explicit NewtonEuler(const world::Robot& robot) {
    pinocchio::urdf::buildModel(robot.urdf.string(), model_);
    data_ = pinocchio::Data(model_);
  }

  void round(const rt::MonotonicClock& clock, const std::vector<AxisState>& states, std::vector<double>& took_us) {
    for (const AxisState& state : states) {
      q_ = state.position;
      v_ = state.speed;
      a_ = state.acceleration;
      const Time begin = clock.now();
      pinocchio::rnea(model_, data_, q_, v_, a_);
      took_us.push_back(1e6 * to_s(clock.now() - begin));
      sum_ += data_.tau.sum();
    }
  }
  [[nodiscard]] double sum() const { return sum_; }

 private:
  pinocchio::Model model_;
  pinocchio::Data data_;
  Eigen::VectorXd q_, v_, a_;
  double sum_ = 0;
};

// Prints a line; the median of the whole step.
double measure(const std::string& name, int rounds) {
  const world::World world = must(world::load(apps::worlds_folder(), name));
  const rt::MonotonicClock clock;
  const auto loop = std::make_unique<Loop>(world);
  NewtonEuler newton_euler(world.robot);
  std::vector<double> steps_us, steps_99_us, alone_us;
  for (int i = 0; i < rounds; ++i) {
    const double clock_us = clock_cost_us(clock);
    std::vector<double> step_us, rnea_us;
    std::vector<AxisState> states;
    loop->round(clock, step_us, states);
    newton_euler.round(clock, states, rnea_us);
    steps_us.push_back(median(step_us) - clock_us);
    steps_99_us.push_back(percentile(std::move(step_us), 0.99) - clock_us);
    alone_us.push_back(median(std::move(rnea_us)) - clock_us);
  }
  const double step_us = median(std::move(steps_us)), rnea_us = median(std::move(alone_us));
  fmt::print(
      "{}, {} axes: control step {:.2f} µs (99 %: {:.2f}), recursive Newton-Euler alone {:.2f} µs, ratio {:.1f}\n",
      world.robot.name, world.robot.home.size(), step_us, median(std::move(steps_99_us)), rnea_us, step_us / rnea_us);
  if (newton_euler.sum() == 0) give_up({"recursive Newton-Euler gave no torque", world.robot.name, {}});
  return step_us;
}

}  // namespace

int main(int argc, char** argv) {
  const bool gate = argc > 1 && std::strcmp(argv[1], "--gate") == 0;
  const int rounds = argc > (gate ? 2 : 1) ? std::atoi(argv[gate ? 2 : 1]) : 9;
  if (rounds < 1) {
    fmt::print(stderr, "usage: control_step [--gate] [ROUNDS (9)]\n");
    return 2;
  }
  const double seven_us = measure("small_cell", rounds);
  measure("parcel_cell", rounds);
  const bool good = seven_us <= kBarMedian_us;
  fmt::print("medians of {} rounds of {} steps in motion; bar of {:.0f} µs for seven axes {}\n", rounds, kStepsPerRound,
             kBarMedian_us, good ? "kept" : "MISSED");
  return gate && !good ? 1 : 0;
}
