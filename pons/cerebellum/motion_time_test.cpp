// A motion that is slowed goes the same way, and keeps every limit while its rate changes.
#include "pons/cerebellum/motion_time.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "pons/cerebellum/limit_watch.hpp"
#include "pons/cerebellum/test_bench.hpp"
#include "pons/core/random.hpp"

namespace pons::cerebellum {
namespace {

using namespace std::chrono_literals;

AxisState resting_at(const AxisVector& position) {
  return {position, AxisVector::Zero(position.size()), AxisVector::Zero(position.size())};
}

AxisVector random_place(Random& random) {
  AxisVector to = bench_robot().home;
  for (Eigen::Index i = 0; i < to.size(); ++i) to[i] += 1.2 * random.uniform(-1, 1);
  return to;
}

// As skills plan them: a little inside the limits.
AxisLimits planned_limits() {
  AxisLimits limits = bench_robot().limits;
  limits.speed_rad_s *= 0.97;
  limits.acceleration_rad_s2 *= 0.97;
  limits.jerk_rad_s3 *= 0.97;
  return limits;
}

TEST(MotionTime, IsTheClockAtFullRate) {
  MotionQueue queue;
  queue.rest(bench_robot().home, Time{});
  MotionTime time;
  time.restart(Time(5ms));
  AxisState state = resting_at(bench_robot().home);
  for (int i = 0; i < 100; ++i) (void)time.step(queue, bench_robot().limits, 1, 1ms, state);
  EXPECT_EQ(time.time(), Time(105ms));
  EXPECT_EQ(time.rate(), 1);
}

TEST(MotionTime, PeekingSeesWhatSamplingWillAndDropsNothing) {
  MotionQueue queue;
  queue.rest(bench_robot().home, Time{});
  for (const Segment& segment :
       point_to_point(resting_at(bench_robot().home), Time(3ms), bench_robot().home.array() + 0.7, planned_limits()))
    ASSERT_EQ(queue.append(segment, false, Time{}), Refusal::kNone);
  AxisState seen = resting_at(bench_robot().home), sampled = seen;
  std::size_t hint = 0;
  std::vector<AxisState> ahead;
  for (Time time(1ms); time < Time(2s); time += 1ms) {
    queue.peek(time, hint, seen);
    ahead.push_back(seen);
  }
  for (Time time(1ms); time < Time(2s); time += 1ms) {
    (void)queue.sample(time, sampled);
    const AxisState& peeked = ahead[static_cast<std::size_t>(time.ns() / 1'000'000 - 1)];
    // At a seam one sees the end of a segment, the other the begin of the next.
    ASSERT_LT((peeked.position - sampled.position).cwiseAbs().maxCoeff(), SeamTolerance::kPosition) << time.s();
    ASSERT_LT((peeked.acceleration - sampled.acceleration).cwiseAbs().maxCoeff(), SeamTolerance::kAcceleration);
  }
}

// Every tick of random motion under random changes of the rate: on its path, and inside the limits.
TEST(MotionTime, RandomMotionsAtRandomRatesKeepTheirWayAndEveryLimit) {
  int impossible = 0, changes = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const AxisLimits& limits = bench_robot().limits;
    const LimitWatch watch(limits);
    MotionQueue queue, original;
    queue.rest(bench_robot().home, Time{});
    original.rest(bench_robot().home, Time{});
    AxisState state = resting_at(bench_robot().home), way = state;
    Time begin(5ms);
    AxisVector from = bench_robot().home;
    for (int leg = 0; leg < 4; ++leg) {
      const AxisVector to = random_place(random);
      for (const Segment& segment : point_to_point(resting_at(from), begin, to, planned_limits())) {
        ASSERT_EQ(queue.append(segment, false, Time{}), Refusal::kNone);
        ASSERT_EQ(original.append(segment, false, Time{}), Refusal::kNone);
        begin = segment.end();
      }
      from = to;
    }
    MotionTime time;
    double wanted = 1;
    for (int tick = 0; time.time() < begin && tick < 60'000; ++tick) {
      if (random.uniform(0, 1) < 0.004) {
        wanted = random.uniform(0, 1) < 0.4 ? 1 : random.uniform(0.1, 1);
        ++changes;
      }
      AxisState next = state;
      const auto step = time.step(queue, limits, wanted, 1ms, next);
      if (!step.possible) {
        ++impossible;
        break;
      }
      const auto breach = watch.breach(state, next, 1e-3);
      ASSERT_FALSE(breach) << "axis " << breach->axis << ": " << name(breach->limit) << " at " << time.time().s()
                           << " s, rate " << time.rate();
      (void)original.sample(time.time(), way);
      ASSERT_LT((way.position - next.position).cwiseAbs().maxCoeff(), 1e-9);
      ASSERT_LE(time.rate(), 1.0);
      state = next;
    }
  }
  std::printf("%d changes of rate, %d without a way\n", changes, impossible);
  EXPECT_LE(impossible, changes / 100);
}

// How soon a motion at full speed is slow, whatever it is doing then.
TEST(MotionTime, IsSlowSoon) {
  double worst_s = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    MotionQueue queue;
    queue.rest(bench_robot().home, Time{});
    for (const Segment& segment :
         point_to_point(resting_at(bench_robot().home), Time(5ms), random_place(random), planned_limits()))
      ASSERT_EQ(queue.append(segment, false, Time{}), Refusal::kNone);
    MotionTime time;
    AxisState state = resting_at(bench_robot().home);
    const Time from(from_s(random.uniform(0, to_s(queue.end().since_start()))));
    Time now;
    for (; now < from; now += 1ms) (void)time.step(queue, bench_robot().limits, 1, 1ms, state);
    const Time began = now;
    for (; now < began + 3s; now += 1ms) {
      if (!time.step(queue, bench_robot().limits, 0.3, 1ms, state).possible) break;
      if (state.speed.cwiseAbs().maxCoeff() <= 0.3 * 3.14 * 1.01) break;
    }
    worst_s = std::max(worst_s, to_s(now - began));
  }
  std::printf("slow within %.0f ms\n", 1e3 * worst_s);
  EXPECT_LT(worst_s, 0.5);
}

}  // namespace
}  // namespace pons::cerebellum
