// A few minutes of what system_run does for hours, with fixed seeds; and that each step at which a bridge may die is
// one at which it does.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/system/episode.hpp"

namespace pons::tests {
namespace {

const Cellar& cellar() {
  static const Expected<Cellar> loaded = Cellar::load();
  return loaded.value();
}

std::string told(const EpisodeResult& result) {
  return fmt::format("{}\n{}", fmt::join(result.last, "\n"), fmt::join(result.wrong, "\n"));
}

EpisodeOptions of(std::uint64_t seed, Duration faults_for) {
  return {.seed = seed, .faults_for = faults_for, .only = {}};
}

TEST(System, OneSeedIsOneStory) {
  const auto options = of(5, std::chrono::minutes(4));
  const EpisodeResult first = run_episode(cellar(), options), again = run_episode(cellar(), options);
  EXPECT_EQ(first.digest, again.digest);
  EXPECT_EQ(first.last, again.last);
  EXPECT_NE(first.digest, run_episode(cellar(), of(6, std::chrono::minutes(4))).digest);
}

// Hours of it: system_run --hours. These must have had everything in them, or they show little.
TEST(System, WhateverGoesWrongNothingIsLostAndNothingDoneTwice) {
  std::size_t accepted = 0, processes = 0, stops = 0;
  NetworkLosses network;
  Disk::Losses disk;
  std::map<task::Outcome, std::size_t> outcomes;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const EpisodeResult result = run_episode(cellar(), of(seed, std::chrono::minutes(10)));
    ASSERT_EQ(result.wrong, std::vector<std::string>{})
        << told(result) << "\nreplay it: system_run --seed " << seed << " --trace";
    accepted += result.accepted;
    processes += result.processes;
    stops += result.stops;
    network.lost += result.network.lost;
    network.repeated += result.network.repeated;
    network.late += result.network.late;
    disk.lost += result.disk.lost;
    disk.torn += result.disk.torn;
    for (const auto& [outcome, times] : result.outcomes) outcomes[outcome] += times;
  }
  EXPECT_GT(accepted, 1000U);
  EXPECT_GT(processes, 200U);
  EXPECT_GT(stops, 40U);
  EXPECT_GT(network.lost, 1000U);
  EXPECT_GT(network.repeated, 1000U);
  EXPECT_GT(network.late, 500U);
  EXPECT_GT(disk.lost, 100U);
  EXPECT_GT(disk.torn, 0U);
  for (const task::Outcome outcome : {task::Outcome::kSucceeded, task::Outcome::kFailed, task::Outcome::kCancelled})
    EXPECT_GT(outcomes[outcome], 100U) << task::name(outcome);
}

// The proof is one only if it finds a disk out that does not do what it says.
TEST(System, ADiskThatNeverSyncsIsFoundOut) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    EpisodeOptions options = of(seed, std::chrono::minutes(10));
    options.syncs = Disk::Syncs::kNever;
    found += run_episode(cellar(), options).wrong.empty() ? 0 : 1;
  }
  EXPECT_GE(found, 5);
}

class EachStep : public testing::TestWithParam<Step> {};

TEST_P(EachStep, IsOneAtWhichTheBridgeMayGo) {
  for (const Fate fate : {Fate::kDies, Fate::kLosesPower, Fate::kIsHeldUp}) {
    EpisodeOptions options = of(1 + static_cast<std::uint64_t>(fate), std::chrono::seconds(100));
    // Come by only where another has gone before; and in an episode whose journal has grown long enough.
    const auto [doing, act, moment] = GetParam();
    const bool recovers = doing == Doing::kTakingOver && (act == Act::kWriteLog || act == Act::kSyncLog);
    if (recovers || (doing == Doing::kCompacting && act == Act::kWriteFile)) {
      options.seed = 2;
      options.before = Plan{.fate = Fate::kLosesPower, .at = Step{Doing::kTicking, Act::kStart, Moment::kAfter}};
    }
    options.only = Plan{.fate = fate, .at = GetParam(), .held_up = std::chrono::milliseconds(1500)};
    const EpisodeResult result = run_episode(cellar(), options);
    ASSERT_EQ(result.wrong, std::vector<std::string>{}) << told(result) << "\n" << name(GetParam());
    ASSERT_TRUE(result.passed.contains(GetParam())) << name(GetParam()) << " is not come by";
    for (const auto& [step, times] : result.passed)
      EXPECT_EQ(std::ranges::count(all_steps(), step), 1) << name(step) << " is come by, and nobody goes there";
    EXPECT_EQ(result.ends.contains(GetParam()), fate != Fate::kIsHeldUp);
  }
}

std::string as_name(const testing::TestParamInfo<Step>& info) {
  std::string text = name(info.param);
  std::ranges::replace_if(text, [](char letter) { return letter == ' ' || letter == ':'; }, '_');
  return text;
}

INSTANTIATE_TEST_SUITE_P(System, EachStep, testing::ValuesIn(all_steps().begin(), all_steps().end()), as_name);

}  // namespace
}  // namespace pons::tests
