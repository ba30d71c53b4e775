#include "pons/motion/chunks.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <functional>
#include <string>

#include "pons/core/random.hpp"

namespace pons::motion {
namespace {

using std::chrono::milliseconds;

constexpr Duration kTick = milliseconds(1), kBridgeTick = milliseconds(10), kLead = milliseconds(20);

AxisLimits limits_of(Eigen::Index axes) {
  AxisLimits limits;
  limits.position_min = AxisVector::Constant(axes, -3);
  limits.position_max = AxisVector::Constant(axes, 3);
  limits.speed_rad_s = AxisVector::Constant(axes, 2);
  limits.acceleration_rad_s2 = AxisVector::Constant(axes, 10);
  limits.jerk_rad_s3 = AxisVector::Constant(axes, 200);
  return limits;
}

AxisVector all(Eigen::Index axes, double value) { return AxisVector::Constant(axes, value); }

// What the bridge asked for, as the cerebellum's queue keeps it, followed tick by tick; every tick is judged.
class Follower {
 public:
  Follower(const AxisVector& position, AxisLimits limits) : limits_(std::move(limits)), state_(at_rest(position)) {}

  void queue(const Trajectory& trajectory) {
    ASSERT_FALSE(trajectory.empty());
    const Time start = trajectory.front().start;
    ASSERT_GE(start, now_) << "from the past";
    const AxisState before = at(start);
    AxisState after = before;
    pons::sample(trajectory.front(), start, after);
    seam_ = std::max({seam_, (before.position - after.position).cwiseAbs().maxCoeff(),
                      (before.speed - after.speed).cwiseAbs().maxCoeff(),
                      (before.acceleration - after.acceleration).cwiseAbs().maxCoeff()});
    std::erase_if(asked_, [&](const Segment& s) { return s.start >= start; });
    asked_.insert(asked_.end(), trajectory.begin(), trajectory.end());
    const AxisState end = motion::sample(asked_, asked_.back().end(), state_.position.size());
    EXPECT_LT(end.speed.cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LE(asked_.size(), 256u);
  }

  // One tick on.
  void step() {
    now_ += kTick;
    const AxisState next = at(now_);
    const double dt_s = to_s(kTick);
    const auto share = [](const AxisVector& value, const AxisVector& limit) {
      return (value.cwiseAbs().array() / limit.array()).maxCoeff();
    };
    use_.speed = std::max(use_.speed, share(next.speed, limits_.speed_rad_s));
    use_.acceleration = std::max(use_.acceleration, share(next.acceleration, limits_.acceleration_rad_s2));
    use_.jerk = std::max(use_.jerk, share((next.acceleration - state_.acceleration) / dt_s, limits_.jerk_rad_s3));
    use_.inside_position = use_.inside_position && (next.position.array() >= limits_.position_min.array()).all() &&
                           (next.position.array() <= limits_.position_max.array()).all();
    state_ = next;
    std::erase_if(asked_, [&](const Segment& s) { return s.end() < now_ && &s != &asked_.back(); });
  }

  [[nodiscard]] AxisState at(Time time) const {
    return asked_.empty() ? state_ : motion::sample(asked_, time, state_.position.size());
  }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] const AxisState& state() const { return state_; }
  [[nodiscard]] const LimitUse& use() const { return use_; }
  [[nodiscard]] double seam() const { return seam_; }

 private:
  AxisLimits limits_;
  Trajectory asked_;
  Time now_;
  AxisState state_;
  LimitUse use_;
  double seam_ = 0;
};

// A policy that is asked every `every` and answers late; requests overlap.
struct Latency {
  Duration usual, first, every;
};

// Runs a stream for `for_s`; `act` gives the actions from number `observed` on.
struct Tally {
  std::int64_t starved = 0, taken = 0, past = 0, unreachable = 0;
  double worst_off = 0;
};
using Act = std::function<std::vector<AxisVector>(double observed)>;
using Judge = std::function<void(const ChunkPath&, const Follower&)>;
Tally run(ChunkPath& path, Follower& follower, const AxisLimits& limits, const Act& act, Duration period,
          const Latency& latency, double for_s, const Judge& judge) {
  struct Pending {
    Time due;
    Chunk chunk;
  };
  std::deque<Pending> pending;
  Tally result;
  Time next_ask;
  bool warm = false, began = false;
  while (follower.now() < Time(from_s(for_s))) {
    const Time now = follower.now();
    if (now.ns() % kBridgeTick.count() == 0) {
      if (now >= next_ask && (warm || pending.empty())) {
        const double observed = path.executed(now);
        pending.push_back({now + (warm ? latency.usual : latency.first), {observed, period, act(observed)}});
        next_ask = now + latency.every;
      }
      while (!pending.empty() && pending.front().due <= now) {
        warm = true;
        const auto way = path.splice(pending.front().chunk, now, now + kLead, limits);
        pending.pop_front();
        if (way) {
          follower.queue(*way);
          began = true;
          ++result.taken;
        } else {
          (way.error().where == "chunk_past" ? result.past : result.unreachable) += 1;
          EXPECT_TRUE(way.error().where == "chunk_past" || way.error().where == "chunk_limits") << way.error().line();
        }
      }
    }
    follower.step();
    if (began && path.starved(follower.now())) ++result.starved;
    judge(path, follower);
  }
  return result;
}

// ---- alignment ----

// Actions on a straight line: wherever the arm is on it tells how many it has executed.
std::vector<AxisVector> ramp(double observed, std::size_t count, double step) {
  std::vector<AxisVector> actions;
  for (std::size_t j = 0; j < count; ++j) actions.push_back(all(2, step * (observed + static_cast<double>(j) + 1)));
  return actions;
}

class ChunksAtDelay : public testing::TestWithParam<int> {};

// The first inference takes 1.5 s, longer than a chunk: were it taken for the usual one, or were actions counted by the
// clock, nothing of the chunk would be left.
TEST_P(ChunksAtDelay, ActionsAreWhereTheyBelongAndNoneIsMissed) {
  const AxisLimits limits = limits_of(2);
  const Duration period = milliseconds(50);
  ChunkPath path(all(2, 0), Time{}, 0);
  Follower follower(all(2, 0), limits);
  double off = 0;
  const Tally result = run(
      path, follower, limits, [](double observed) { return ramp(observed, 20, 0.01); }, period,
      {milliseconds(GetParam()), milliseconds(1500), milliseconds(200)}, 12,
      [&](const ChunkPath& p, const Follower& f) {
        if (f.now() < Time(from_s(2.5))) return;
        off = std::max(off, std::abs(f.state().position[0] - 0.01 * p.executed(f.now())));
      });
  std::printf("delay %d ms: %lld of 12000 ticks starved, %lld chunks taken, %.1e rad off, %.1f actions executed\n",
              GetParam(), static_cast<long long>(result.starved), static_cast<long long>(result.taken), off,
              path.executed(follower.now()));
  EXPECT_EQ(result.starved, 0);
  EXPECT_EQ(result.past, 0);
  EXPECT_EQ(result.unreachable, 0);
  EXPECT_LT(off, 1e-9);
  // From rest it takes up the pace within 0.2 s; from then on it loses nothing.
  EXPECT_GT(path.executed(follower.now()), (12 - 1.5 - 0.2) / 0.05);
  EXPECT_LT(follower.seam(), 1e-9);
  EXPECT_LE(follower.use().worst(), 1 + 1e-9);
}
INSTANTIATE_TEST_SUITE_P(Delays, ChunksAtDelay, testing::Values(0, 100, 200, 300));

// A policy that is so slow starves: the motion stops by itself, and goes on when more comes.
TEST(Chunks, StarveByNameWhereTheDelayIsTooLong) {
  for (const int delay_ms : {600, 900, 1500}) {
    const AxisLimits limits = limits_of(2);
    ChunkPath path(all(2, 0), Time{}, 0);
    Follower follower(all(2, 0), limits);
    bool rested = false;
    double off = 0;
    // One inference at a time.
    const Tally result = run(
        path, follower, limits, [](double observed) { return ramp(observed, 20, 0.01); }, milliseconds(50),
        {milliseconds(delay_ms), milliseconds(1500), milliseconds(delay_ms)}, 12,
        [&](const ChunkPath& p, const Follower& f) {
          if (!p.starved(f.now())) return;
          const bool rests = f.state().speed.cwiseAbs().maxCoeff() < 1e-12 && p.executed(f.now()) > 0;
          rested = rested || rests;
          if (rests) off = std::max(off, std::abs(f.state().position[0] - 0.01 * p.executed(f.now())));
        });
    std::printf("delay %d ms, one inference at a time: %lld of 12000 ticks starved, %.1f actions executed\n", delay_ms,
                static_cast<long long>(result.starved), path.executed(follower.now()));
    EXPECT_GT(result.starved, 500);
    EXPECT_TRUE(rested || delay_ms < 900);
    EXPECT_LT(off, 1e-9);  // where it rests all its actions have been executed
    EXPECT_GT(path.executed(follower.now()), 60);
    EXPECT_LT(follower.seam(), 1e-9);
    EXPECT_LE(follower.use().worst(), 1 + 1e-9);
  }
}

// Where nothing more comes it slows down on the curve that the actions give, each axis in its place, and not straight
// to the end.
TEST(Chunks, StarvingSlowsDownAlongACurve) {
  const auto curve = [](double executed) {
    const double phase = 0.06 * executed;
    return AxisVector{{0.4 * std::sin(phase), 0.3 * (1 - std::cos(phase)), 0.2 * std::sin(2 * phase)}};
  };
  double worst = 0;
  for (const int delay_ms : {0, 100, 300}) {
    for (const double dries_up_s : {2.0, 2.33, 2.67, 3.0}) {
      const AxisLimits limits = limits_of(3);
      const Act act = [&](double observed) {
        std::vector<AxisVector> actions;
        for (int j = 1; j <= 50; ++j) actions.push_back(curve(observed + j));
        return actions;
      };
      ChunkPath path(curve(0), Time{}, 0);
      Follower follower(curve(0), limits);
      (void)run(path, follower, limits, act, milliseconds(20),
                {milliseconds(delay_ms), milliseconds(500), milliseconds(100)}, dries_up_s,
                [](const ChunkPath&, const Follower&) {});
      int slowing = 0;
      for (double before = path.executed(follower.now()); follower.now() < path.end();) {
        follower.step();
        const double executed = path.executed(follower.now()), pace = (executed - before) / 0.05;
        before = executed;
        if (!path.starved(follower.now())) continue;
        if (pace > 0.05 && pace < 0.95) ++slowing;
        worst = std::max(worst, (follower.state().position - curve(executed)).cwiseAbs().maxCoeff());
      }
      EXPECT_GT(slowing, 100);
      EXPECT_TRUE(follower.state().speed.isZero(1e-9));
      EXPECT_LT(follower.seam(), 1e-9);
      EXPECT_LE(follower.use().worst(), 1 + 1e-6);
    }
  }
  std::printf("slowing down for want of actions: at most %.1e rad off the curve\n", worst);
  EXPECT_LT(worst, 2e-3);  // of 0.4: what is evened out of a curve
}

// ---- random streams ----

// A smooth motion that the policy has in mind, and how badly it says so.
struct RandomPolicy {
  explicit RandomPolicy(Random& random)
      : axes(1 + static_cast<Eigen::Index>(random.below(8))),
        period(from_s(random.uniform(0.02, 0.2))),
        count(static_cast<std::size_t>(random.uniform(0.3, 2.0) / to_s(period)) + 1),
        jump_rad(random.below(2) == 0 ? 0 : random.uniform(0, 0.1)),
        noise_rad(random.below(2) == 0 ? 0 : random.uniform(0, 0.005)),
        amplitude(random.uniform(0.05, 1.0)),
        turn_rad_s(random.uniform(0.2, 3.0)),
        noise(random.fork(1)) {}

  std::vector<AxisVector> act(double observed) {
    const double jump = jump_rad * noise.normal();
    std::vector<AxisVector> actions;
    for (std::size_t j = 0; j < count; ++j) {
      AxisVector action(axes);
      const double at_s = to_s(period) * (observed + static_cast<double>(j) + 1);
      for (Eigen::Index i = 0; i < axes; ++i) {
        const double phase = turn_rad_s * at_s * (1 + 0.3 * static_cast<double>(i));
        action[i] = std::clamp(amplitude * std::sin(phase) + jump + noise_rad * noise.normal(), -2.9, 2.9);
      }
      actions.push_back(action);
    }
    return actions;
  }

  Eigen::Index axes;
  Duration period;
  std::size_t count;
  double jump_rad, noise_rad, amplitude, turn_rad_s;
  Random noise;
};

TEST(Chunks, RandomStreamsKeepEveryLimitAndNeverJump) {
  constexpr int kStreams = 1000;
  std::int64_t taken = 0, unreachable = 0, rests_elsewhere = 0;
  double seam = 0, worst = 0;
  for (int i = 0; i < kStreams; ++i) {
    SCOPED_TRACE("stream " + std::to_string(i));
    Random random = Random(19).fork(static_cast<std::uint64_t>(i));
    RandomPolicy policy(random);
    AxisLimits limits = limits_of(policy.axes);
    limits.speed_rad_s *= random.uniform(0.3, 1.5);
    limits.acceleration_rad_s2 *= random.uniform(0.3, 2);
    limits.jerk_rad_s3 *= random.uniform(0.3, 3);
    ChunkPath path(all(policy.axes, 0), Time{}, 0);
    Follower follower(all(policy.axes, 0), limits);
    const Latency latency{from_s(random.uniform(0, 0.6)), from_s(random.uniform(0, 2)),
                          from_s(random.uniform(0.02, 0.3))};
    double last_progress = 0;
    const Tally result = run(
        path, follower, limits, [&](double observed) { return policy.act(observed); }, policy.period, latency, 4,
        [&](const ChunkPath& p, const Follower& f) {
          const double progress = p.executed(f.now());
          ASSERT_GE(progress, last_progress - 1e-9) << "actions were taken back";
          last_progress = progress;
        });
    // Nothing more comes: it rests at the end of what did.
    while (follower.now() < path.end()) follower.step();
    follower.step();
    EXPECT_TRUE(follower.state().speed.isZero(1e-9));
    if (std::abs(path.executed(follower.now()) - path.queued()) > 1e-9) ++rests_elsewhere;
    seam = std::max(seam, follower.seam());
    worst = std::max(worst, follower.use().worst());
    ASSERT_LT(follower.seam(), 1e-9);
    ASSERT_LE(follower.use().worst(), 1 + 1e-6);
    taken += result.taken;
    unreachable += result.unreachable;
  }
  std::printf("%d streams: %lld chunks spliced, worst seam %.1e, worst use of a limit %.6f, %lld not joined\n",
              kStreams, static_cast<long long>(taken), seam, worst, static_cast<long long>(unreachable));
  EXPECT_GT(taken, 10 * kStreams);
  EXPECT_LT(unreachable, taken / 50);
  EXPECT_EQ(rests_elsewhere, 0);
}

// ---- stopping, and what is refused ----

TEST(Chunks, StopComesToRestOnThePath) {
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const AxisLimits limits = limits_of(2);
    ChunkPath path(all(2, 0), Time{}, 0);
    Follower follower(all(2, 0), limits);
    const double step = random.uniform(0.005, 0.035), stop_s = random.uniform(0.2, 3);
    (void)run(
        path, follower, limits, [&](double observed) { return ramp(observed, 20, step); }, milliseconds(50),
        {milliseconds(100), milliseconds(100), milliseconds(100)}, std::round(100 * stop_s) / 100,
        [](const ChunkPath&, const Follower&) {});
    const Time now = follower.now();
    const double before = path.executed(now);
    const auto way = path.stop(now + kLead, limits);
    ASSERT_TRUE(way) << way.error().line();
    follower.queue(*way);
    EXPECT_LE(path.end() - now, milliseconds(1500));
    while (follower.now() < path.end()) follower.step();
    EXPECT_TRUE(follower.state().speed.isZero(1e-9));
    EXPECT_FALSE(path.starved(follower.now()));
    EXPECT_GE(path.executed(follower.now()), before);
    // Both axes have the same way to go: on the path they are at the same place.
    EXPECT_NEAR(follower.state().position[0], follower.state().position[1], 1e-12);
    if (before > 10) {
      EXPECT_NEAR(follower.state().position[0], step * path.executed(follower.now()), 1e-9);
    }
    EXPECT_LT(follower.seam(), 1e-9);
    EXPECT_LE(follower.use().worst(), 1 + 1e-6);
  }
}

// A stream that is under way, and what it says to one chunk more. The motion is never touched by what is refused.
class RefusedChunk : public testing::Test {
 protected:
  RefusedChunk() {
    follower_.queue(
        path_.splice({0, milliseconds(50), ramp(0, 20, 0.01), false}, Time{}, Time(kLead), limits_).value());
    while (follower_.now() < Time(milliseconds(500))) follower_.step();
  }
  std::string error_of(const Chunk& chunk) {
    const Time now = follower_.now();
    const Time end = path_.end();
    const double queued = path_.queued();
    const auto way = path_.splice(chunk, now, now + kLead, limits_);
    EXPECT_EQ(path_.end(), end);
    EXPECT_EQ(path_.queued(), queued);
    return way ? "taken" : way.error().where;
  }
  Chunk good() const { return {path_.executed(follower_.now()), milliseconds(50), ramp(9, 20, 0.01), false}; }

  const AxisLimits limits_ = limits_of(2);
  ChunkPath path_{all(2, 0), Time{}, 0};
  Follower follower_{all(2, 0), limits_};
};

TEST_F(RefusedChunk, IsNamed) {
  Chunk chunk = good();
  chunk.actions[3] = all(3, 0.1);
  EXPECT_EQ(error_of(chunk), "chunk_size");
  chunk = good();
  chunk.actions[3][1] = std::nan("");
  EXPECT_EQ(error_of(chunk), "chunk_not_finite");
  chunk = good();
  chunk.actions[3][1] = 3.01;
  EXPECT_EQ(error_of(chunk), "chunk_position");
  chunk = good();
  chunk.actions.clear();
  EXPECT_EQ(error_of(chunk), "chunk_empty");
  for (const Duration period : {Duration{0}, Duration{-1}, Duration(milliseconds(19)), Duration(milliseconds(201))}) {
    chunk = good();
    chunk.period = period;
    EXPECT_EQ(error_of(chunk), "chunk_period");
  }
  chunk = good();
  chunk.actions.resize(81, all(2, 0.1));
  EXPECT_EQ(error_of(chunk), "chunk_long");
  chunk = good();
  for (const double observed : {-1.0, std::nan(""), HUGE_VAL}) {
    chunk = good();
    chunk.observed = observed;
    EXPECT_EQ(error_of(chunk), "chunk_observed");
  }
}

TEST_F(RefusedChunk, IsOfThePastWhenAllItsActionsAreExecuted) {
  Chunk chunk = good();
  chunk.observed = 0;
  chunk.actions.resize(static_cast<std::size_t>(path_.executed(follower_.now())));
  EXPECT_EQ(error_of(chunk), "chunk_past");
}

TEST_F(RefusedChunk, IsOfTheFutureWhenMoreWasObservedThanIsExecuted) {
  Chunk chunk = good();
  chunk.observed += 0.1;
  EXPECT_EQ(error_of(chunk), "chunk_future");
}

// By the clock half a second of the stream has passed and ten actions; the arm has executed fewer, since it had to take
// up speed first.
TEST_F(RefusedChunk, IsWhatCountsByTheClock) {
  Chunk chunk = good();
  chunk.observed = to_s(follower_.now().since_start()) / to_s(chunk.period);
  EXPECT_EQ(error_of(chunk), "chunk_future");
}

TEST_F(RefusedChunk, NeverJumpsHoweverFarItIs) {
  Chunk chunk = good();
  chunk.actions = std::vector<AxisVector>(20, all(2, 2.9));
  const Time now = follower_.now();
  const auto way = path_.splice(chunk, now, now + kLead, limits_);
  ASSERT_TRUE(way) << way.error().line();
  follower_.queue(*way);
  while (follower_.now() < path_.end()) follower_.step();
  EXPECT_NEAR(follower_.state().position[0], 2.9, 1e-9);
  EXPECT_LT(follower_.seam(), 1e-9);
  EXPECT_LE(follower_.use().worst(), 1 + 1e-9);
}

}  // namespace
}  // namespace pons::motion
