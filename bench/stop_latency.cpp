// From the request of an emergency stop to the first set-points that decelerate: a real cerebellum on a real-time
// thread, an arm that does as it is told, in full motion; requests at any phase of the period. And how the stopping
// time compares with the shortest that the jerk limits allow.
//
// usage: stop_latency [--gate] [STOPS a round (100)] [ROUNDS (5)]      --gate: exit 1 where a bar is missed

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "apps/paths.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/motion/axis_plan.hpp"
#include "pons/motion/motion.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/skills/arm.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;
using namespace std::chrono_literals;
using link::SafetyState;

constexpr Duration kPeriod = 1ms, kLead = 50ms;
constexpr int kBridgePriority = 10;
constexpr double kBar50_us = 50, kBar99_us = 200, kBarTime = 1.05;

template <typename T>
T must(Expected<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "stop_latency: {}\n", result.error().line());
  std::exit(2);
}

double shortest_stop_s(const AxisState& state, const AxisLimits& limits) {
  double longest = 0;
  for (Eigen::Index i = 0; i < state.position.size(); ++i) {
    const auto bounds =
        motion::AxisBounds::symmetric(limits.speed_rad_s[i], limits.acceleration_rad_s2[i], limits.jerk_rad_s3[i]);
    const motion::SpeedPlan stop({state.position[i], state.speed[i], state.acceleration[i]}, 0, bounds);
    longest = std::max(longest, stop.duration_s());
  }
  return longest;
}

// What the loop's thread found; read when it has ended.
struct Found {
  std::vector<rt::Histogram> latency;  // a round: from the request to the end of the step that decelerates
  std::vector<double> over_shortest;   // stopping time over the shortest there is
};

// The arm here is where it was told to be, whatever its torques: to the observer that looks like a push.
cerebellum::Settings without_collisions() {
  cerebellum::Settings settings;
  settings.collision.torque_share = 1e9;
  return settings;
}

// The loop's thread: steps the cerebellum, lets the arm follow, and notes stops.
class Loop {
 public:
  Loop(const world::World& world, link::Link& link)
      : end_(link),
        cerebellum_(must(model::RobotModel::load(world.robot)), without_collisions(), Time{}),
        limits_(world.robot.limits) {
    sensors_.position = world.robot.home;
    sensors_.speed = AxisVector::Zero(sensors_.position.size());
  }

  const rt::MonotonicClock clock;
  std::atomic<std::int64_t> raised_ns{0};
  std::atomic<std::size_t> round{0};
  std::atomic<bool> running{true};

  Found run(std::size_t rounds) {
    const rt::Grant grant = rt::make_realtime({.cpu = rt::loop_cpu()});
    if (grant.degraded()) fmt::print("degraded: {}\n", fmt::join(grant.refused, "; "));
    rt::PeriodicLoop loop(clock, kPeriod, end_.emergency_word());
    Found found;
    found.latency.resize(rounds);
    found.over_shortest.reserve(100'000);
    loop.run([&](Time now) {
      tick(now, found);
      return running.load();
    });
    return found;
  }

 private:
  void tick(Time now, Found& found) {
    const AxisState before = cerebellum_.state().commanded;
    const SafetyState was = cerebellum_.state().safety;
    sensors_.stamp = now;
    cerebellum_.step(now, sensors_, end_, set_points_);
    const link::State& state = cerebellum_.state();
    const bool began = was == SafetyState::kOperational && state.safety == SafetyState::kEmergencyStopping;
    if (began && state.cause == link::StopCause::kEmergencyWord) {
      found.latency[round.load()].record(clock.now() - Time(Duration(raised_ns.load())));
      shortest_s_ = shortest_stop_s(before, limits_);
      began_ = last_;
    }
    // Rest shows at the first tick after it: the tick before may have been a moment from it.
    if (shortest_s_ > 0 && cerebellum::is_at_rest(state.commanded))
      found.over_shortest.push_back(to_s(last_ - began_) / std::exchange(shortest_s_, 0.0));
    if (set_points_.power) {
      sensors_.position = state.commanded.position;
      sensors_.speed = state.commanded.speed;
    }
    last_ = now;
  }

  link::CerebellumEnd end_;
  cerebellum::Cerebellum cerebellum_;
  const AxisLimits limits_;
  body::Sensors sensors_;
  body::SetPoints set_points_;
  Time last_, began_;
  double shortest_s_ = 0;  // of the stop under way; 0 when there is none
};

// The bridge's side: moves the arm to and fro, and raises the word in full motion.
class Bridge {
 public:
  Bridge(const world::World& world, link::Link& link, Loop& loop)
      : world_(world), link_(link), end_(link), loop_(loop), arm_(end_, world, kLead) {}

  void stop_in_motion(Duration after, Duration phase) {
    wait_until([&] { return arm_.operational(); }, [&] { arm_.arm(loop_.clock.now()); });
    AxisLimits limits = world_.robot.limits;
    limits.speed_rad_s *= 0.97, limits.acceleration_rad_s2 *= 0.97, limits.jerk_rad_s3 *= 0.97;
    const Time from = arm_.splice_time(loop_.clock.now(), limits);
    AxisVector target = world_.robot.home;
    if (std::exchange(there_, !there_)) target.array() += 0.8;
    if (!arm_.stream(must(motion::move(arm_.planned(from), from, {target, AxisVector::Zero(target.size())}, limits))))
      std::exit(2);
    const Time then = loop_.clock.now() + after;
    wait_until([&] { return loop_.clock.now() >= then; }, [] {});
    std::this_thread::sleep_for(phase);
    loop_.raised_ns.store(loop_.clock.now().ns());
    link_.raise_emergency_stop();
    wait_until([&] { return arm_.state().safety == SafetyState::kEmergencyStop; }, [] {});
    link_.clear_emergency_stop();
  }

 private:
  template <typename Done, typename Act>
  void wait_until(Done done, Act act) {
    for (;;) {
      arm_.refresh(loop_.clock.now());
      if (done()) return;
      act();
      std::this_thread::sleep_for(5ms);
    }
  }

  const world::World& world_;
  link::Link& link_;
  link::BridgeEnd end_;
  Loop& loop_;
  skills::Arm arm_;
  bool there_ = false;
};

double median(std::vector<double> values) {
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

// Whether the bars are kept.
bool report(const Found& found, int asked) {
  std::vector<double> half, most, worst;
  std::uint64_t count = 0;
  for (const rt::Histogram& round : found.latency) {
    half.push_back(1e6 * to_s(round.percentile(50)));
    most.push_back(1e6 * to_s(round.percentile(99)));
    worst.push_back(1e6 * to_s(round.max()));
    count += round.count();
    fmt::print("round: {} stops, {:.1f} µs (50 %), {:.1f} (99 %), {:.1f} (worst)\n", round.count(), half.back(),
               most.back(), worst.back());
  }
  fmt::print(
      "{} of {} stops in motion: request to decelerating set-points {:.1f} µs (50 %), {:.1f} (99 %), medians of "
      "{} rounds; {:.1f} (worst)\n",
      count, asked, median(half), median(most), found.latency.size(), *std::ranges::max_element(worst));
  const double longest = found.over_shortest.empty() ? 0 : *std::ranges::max_element(found.over_shortest);
  fmt::print("stopping time over the shortest within the jerk limits: {:.3f} at most, of {} stops\n", longest,
             found.over_shortest.size());
  const bool all = count >= static_cast<std::uint64_t>(asked) - 1;  // the first one is asked for at rest
  const bool good = all && median(half) <= kBar50_us && median(most) <= kBar99_us && longest <= kBarTime;
  fmt::print("bars {}\n", good ? "kept" : "MISSED");
  return good;
}

}  // namespace

int main(int argc, char** argv) {
  const bool gate = argc > 1 && std::strcmp(argv[1], "--gate") == 0;
  const int first = gate ? 2 : 1;
  const int stops = argc > first ? std::atoi(argv[first]) : 100;
  const int rounds = argc > first + 1 ? std::atoi(argv[first + 1]) : 5;
  if (stops < 1 || rounds < 1) {
    fmt::print(stderr, "usage: stop_latency [--gate] [STOPS a round (100)] [ROUNDS (5)]\n");
    return 2;
  }
  const world::World world = must(world::load(apps::worlds_folder(), "parcel_cell"));
  const auto link = std::make_unique<link::Link>();
  const auto loop = std::make_unique<Loop>(world, *link);
  Found found;
  std::thread thread([&] { found = loop->run(static_cast<std::size_t>(rounds)); });
  const rt::Grant grant = rt::make_realtime({.priority = kBridgePriority});  // as in a run: heartbeats must not wait
  Bridge bridge(world, *link, *loop);
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int64_t> after_ms(180, 450), phase_us(0, 1000);
  for (int round = 0; round < rounds; ++round) {
    loop->round.store(static_cast<std::size_t>(round));
    for (int i = 0; i < stops; ++i)
      bridge.stop_in_motion(std::chrono::milliseconds(after_ms(random)), std::chrono::microseconds(phase_us(random)));
  }
  loop->running.store(false);
  thread.join();
  return report(found, stops * rounds) || !gate ? 0 : 1;
}
