#include "pons/brain/policy_runner.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace pons::brain {
namespace {

using std::chrono::milliseconds;
using task::Json;

constexpr Duration kTick = milliseconds(10), kPeriod = milliseconds(50);
constexpr std::int64_t kActions = 20;

class Standing final : public task::Policy {
 public:
  Chunk infer(const task::Observation& seen) override {
    return {seen.executed, kPeriod, std::vector<AxisVector>(kActions, seen.position), false};
  }
};

// Executes actions at the policy's pace as long as there are some.
class Stream final : public task::ChunkStream {
 public:
  explicit Stream(Json arguments) : told(std::move(arguments)) { told["policy"] = "standing"; }
  [[nodiscard]] std::uint64_t number() const override { return id; }
  [[nodiscard]] const Json& arguments() const override { return told; }
  [[nodiscard]] task::Observation observe(Time now) const override {
    return {.stamp = now,
            .position = AxisVector::Zero(6),
            .speed = AxisVector::Zero(6),
            .executed = static_cast<double>(executed),
            .enough = (end - executed) * kPeriod};
  }
  [[nodiscard]] Expected<void> take(const Chunk& chunk, Time now) override {
    EXPECT_LE(chunk.observed, static_cast<double>(executed));
    end = static_cast<std::int64_t>(chunk.observed) + static_cast<std::int64_t>(chunk.actions.size());
    if (!began) began = now;
    ++taken;
    return {};
  }
  void step(Time now) {
    if (!began || now == *began || (now - *began).count() % kPeriod.count() != 0) return;
    if (executed < end) {
      ++executed;
    } else {
      ++starved;
    }
  }

  Json told;
  std::uint64_t id = 1;
  std::int64_t executed = 0, end = 0, taken = 0, starved = 0;
  std::optional<Time> began;
};

class PolicyRunnerTest : public testing::Test {
 protected:
  void run(Stream& stream, double seconds) {
    for (const Time end = now_ + from_s(seconds); now_ < end; now_ += kTick) {
      stream.step(now_);
      runner_.attend(&stream, now_);
    }
  }
  Time now_;
  PromptInference inference_;
  PolicyRunner runner_{{{"standing", [](const Json&) { return std::make_shared<Standing>(); }}}, inference_};
};

// Ten a second, though each takes 0.3 s: they overlap.
TEST_F(PolicyRunnerTest, AsksAtItsRateWhateverTheLatency) {
  Stream stream({{"rate_hz", 10}, {"latency_s", 0.3}, {"first_latency_s", 0.3}});
  run(stream, 5.3);
  EXPECT_NEAR(static_cast<double>(runner_.asked()), 51, 1);
  EXPECT_EQ(stream.starved, 0);
}

// Only once in five seconds of itself; so it asks when its motion needs it, with the usual latency to spare. Taken for
// the usual one, the first latency would have it ask again at once, each time.
TEST_F(PolicyRunnerTest, TheFirstInferenceIsNotTakenForTheUsualOne) {
  Stream stream({{"rate_hz", 0.2}, {"latency_s", 0.3}, {"first_latency_s", 1.5}});
  run(stream, 1.5);
  EXPECT_EQ(stream.taken, 0);
  EXPECT_EQ(runner_.asked(), 1);
  run(stream, 12);
  EXPECT_LE(stream.starved, 6);  // before it knew the usual one
  EXPECT_GE(runner_.asked(), 23);
  EXPECT_LE(runner_.asked(), 27);
}

TEST_F(PolicyRunnerTest, WhatWasAskedForAnEarlierStreamIsDropped) {
  Stream first({{"rate_hz", 10}, {"latency_s", 1.0}, {"first_latency_s", 1.0}});
  run(first, 0.5);
  Stream second({{"rate_hz", 10}, {"latency_s", 1.0}, {"first_latency_s", 1.0}});
  second.id = 2;
  run(second, 0.9);
  EXPECT_EQ(first.taken + second.taken, 0);
  run(second, 0.2);
  EXPECT_GT(second.taken, 0);
}

TEST_F(PolicyRunnerTest, LeavesAStreamAloneThatSomebodyElseFeeds) {
  Stream stream(Json::object());
  stream.told["policy"] = "outside";
  run(stream, 1);
  EXPECT_EQ(runner_.asked(), 0);
  EXPECT_EQ(stream.taken, 0);
}

}  // namespace
}  // namespace pons::brain
