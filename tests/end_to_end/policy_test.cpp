// A policy moves the arm of the small cell, seven axes and every real part: it is late, its chunks overlap, and what it
// looks at moves.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/assembly.hpp"
#include "pons/sim/truth.hpp"

namespace pons::tests {
namespace {

using task::Json;

class PolicyRun {
 public:
  explicit PolicyRun(const std::string& name = "small_cell", std::vector<sim::Visit> visits = {})
      : world(world::load("worlds", name).value()),
        cell(apps::Assembly::build(world, world::draw_manifest(world, 1, 1).value(),
                                   {.journal = ":memory:", .body = {.visits = std::move(visits)}})
                 .value()) {}

  // What happens between control steps, each bridge period.
  using Meanwhile = std::function<void(Time)>;

  // Runs in lockstep until the task has its outcome.
  void follow(const Json& arguments, const Meanwhile& meanwhile = {}) {
    const Json task{
        {"id", "follow"}, {"priority", 100}, {"steps", {{{"skill", "follow_policy"}, {"arguments", arguments}}}}};
    const auto admitted = cell->above->bridge->submit(task.dump(), Time{});
    ASSERT_TRUE(admitted) << admitted.error().line();
    runner::Parts parts = cell->parts();
    body::Sensors sensors;
    body::SetPoints set_points;
    for (now = Time(runner::kControlPeriod); now < Time(from_s(60)); now += runner::kControlPeriod) {
      parts.body.plant.advance(now);
      parts.body.robots.front().body->read(sensors);
      parts.body.photographer->open_shutters(now, {&sensors, 1});
      cell->body->arms.front()->cerebellum->step(now, sensors, *parts.body.robots.front().link, set_points);
      parts.body.robots.front().body->write(set_points);
      if (now.ns() % runner::kBridgePeriod.count() != 0) continue;
      if (first) first(now);
      const auto ticked = parts.bridge_side->tick(now, *parts.observer);
      ASSERT_TRUE(ticked) << ticked.error().line();
      look();
      if (meanwhile) meanwhile(now);
      const auto history = cell->above->journal->task("follow");
      ASSERT_TRUE(history && *history);
      if (!(*history)->record.outcome) continue;
      outcome = (*history)->record.outcome->outcome;
      reason = (*history)->record.outcome->reason;
      const Json& steps = (*history)->record.outcome->detail.at("steps");
      if (!steps.empty()) detail = steps.at(0).at("detail");
      return;
    }
    FAIL() << "it does not end";
  }

  [[nodiscard]] std::int64_t told(const char* name) const { return detail.at(name).get<std::int64_t>(); }
  void expect_no_limit_broken() const {
    EXPECT_EQ(cell->body->arms.front()->cerebellum->statistics().violations, 0u);
    EXPECT_EQ(cell->body->arms.front()->cerebellum->statistics().refused, 0u);
  }

  [[nodiscard]] task::ChunkStream* stream() const { return cell->above->cell().stream; }
  [[nodiscard]] skills::Arm& arm() const { return cell->above->cell().arm; }

  world::World world;
  std::unique_ptr<apps::Assembly> cell;
  Meanwhile first;  // before the bridge's tick
  Time now;
  Json detail;
  task::Outcome outcome = task::Outcome::kCancelled;
  std::string reason;
  int over_it = 0;            // bridge periods with the parcel in the middle of the pick zone
  double worst_off_m = 0;     // of the tool from the parcel's middle then, along the belt and across
  double worst_height_m = 0;  // of its height over the parcel, from the one asked for

 private:
  // By the simulator's own truth.
  void look() {
    const auto top = sim::Truth(*cell->body->simulation).top(0);
    if (!top || top->translation().x() < 0 || top->translation().x() > world.belt.pick_x_max_m - 0.05) return;
    const Vector3 tip =
        cell->above->cell().model.world_from_tip(cell->body->arms.front()->cerebellum->state().position).translation();
    ++over_it;
    worst_off_m = std::max(worst_off_m, (tip - top->translation()).head<2>().norm());
    worst_height_m = std::max(worst_height_m, std::abs(tip.z() - top->translation().z() - 0.20));
  }
};

struct Pace {
  int rate_hz, delay_ms;
};

class PolicyAtPace : public testing::TestWithParam<Pace> {};

TEST_P(PolicyAtPace, KeepsTheToolOverAParcelThatRidesBy) {
  const auto [rate_hz, delay_ms] = GetParam();
  PolicyRun run;
  run.follow({{"policy", "hover"},
              {"seconds", 16},
              {"height_m", 0.20},
              {"rate_hz", rate_hz},
              {"latency_s", 1e-3 * delay_ms},
              {"first_latency_s", 1.5}});
  ASSERT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason << run.detail.dump();
  std::printf(
      "%d Hz, delay %d ms: %s; over the parcel for %.2f s, at most %.1f mm beside it and %.1f mm off its height\n",
      rate_hz, delay_ms, run.detail.dump().c_str(), 0.01 * run.over_it, 1e3 * run.worst_off_m,
      1e3 * run.worst_height_m);
  EXPECT_EQ(run.told("starved_ticks"), 0);
  EXPECT_EQ(run.told("refused"), 0);
  EXPECT_GE(run.told("chunks"), 15 * rate_hz);
  EXPECT_GE(run.told("executed"), 310);
  EXPECT_GE(run.over_it, 150);
  EXPECT_LT(run.worst_off_m, 0.015);
  EXPECT_LT(run.worst_height_m, 0.01);
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 0u);
  run.expect_no_limit_broken();
}
INSTANTIATE_TEST_SUITE_P(Paces, PolicyAtPace,
                         testing::Values(Pace{5, 0}, Pace{5, 100}, Pace{5, 200}, Pace{5, 300}, Pace{20, 0},
                                         Pace{20, 100}, Pace{20, 200}, Pace{20, 300}, Pace{50, 0}, Pace{50, 100},
                                         Pace{50, 200}, Pace{50, 300}),
                         [](const auto& pace) {
                           return std::to_string(pace.param.rate_hz) + "HzLate" + std::to_string(pace.param.delay_ms);
                         });

// With chunks of 1 s. Asked but once in five seconds, it is asked all the same when its motion would run out.
TEST(Policy, StarvesWhereItIsTooLateAndGoesOnWhenMoreComes) {
  struct Case {
    double latency_s, rate_hz;
    int least, most;  // starved ticks
  };
  for (const auto& [latency_s, rate_hz, least, most] :
       {Case{0.3, 0.2, 0, 1000}, {0.6, 5, 100, 4000}, {0.9, 5, 4000, 13000}, {1.5, 5, 4000, 13000}}) {
    PolicyRun run;
    run.follow({{"policy", "hover"},
                {"seconds", 14},
                {"rate_hz", rate_hz},
                {"latency_s", latency_s},
                {"first_latency_s", 1.5}});
    ASSERT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
    std::printf("delay %.1f s, %.1f a second: %s\n", latency_s, rate_hz, run.detail.dump().c_str());
    EXPECT_GE(run.told("starved_ticks"), least);
    EXPECT_LE(run.told("starved_ticks"), most);
    EXPECT_GE(run.told("executed"), 100);
    EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 0u);
    run.expect_no_limit_broken();
  }
}

// ---- chunks from outside ----

// All axes to what home is and `by` more, in `count` actions.
Chunk chunk_of(const PolicyRun& run, double observed, std::size_t count, double by) {
  Chunk chunk{.observed = observed, .period = std::chrono::milliseconds(50)};
  for (std::size_t j = 1; j <= count; ++j)
    chunk.actions.emplace_back(run.world.robot.home.array() + by * static_cast<double>(j) / static_cast<double>(count));
  return chunk;
}

// The first axis to and fro over the number of executed actions.
double sway(double executed) { return 0.3 * (1 - std::cos(4 * 0.05 * executed)); }
Chunk swaying(const PolicyRun& run, double observed, int count) {
  Chunk chunk{.observed = observed, .period = std::chrono::milliseconds(50)};
  for (int j = 1; j <= count; ++j) {
    chunk.actions.push_back(run.world.robot.home);
    chunk.actions.back()[0] += sway(observed + j);
  }
  return chunk;
}

TEST(Policy, ThatIsOutsideSendsItsChunksAndItsLast) {
  PolicyRun run;
  bool sent = false;
  run.follow({{"policy", "outside"}, {"seconds", 30}}, [&](Time now) {
    task::ChunkStream* const stream = run.cell->above->cell().stream;
    if (stream == nullptr || sent || now < Time(from_s(1))) return;
    Chunk chunk = chunk_of(run, stream->observe(now).executed, 20, 0.1);
    chunk.last = true;
    const auto taken = stream->take(chunk, now);
    ASSERT_TRUE(taken) << taken.error().line();
    sent = true;
  });
  EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
  EXPECT_EQ(run.told("executed"), 20);
  EXPECT_EQ(run.told("starved_ticks"), 0);
  EXPECT_LT(run.now, Time(from_s(5)));
  const AxisVector end = run.world.robot.home.array() + 0.1;
  EXPECT_TRUE(run.cell->body->arms.front()->cerebellum->state().commanded.position.isApprox(end, 1e-9));
  run.expect_no_limit_broken();
}

// To and fro fifty times a second, for four seconds: the limits allow a seventh of that pace.
TEST(Policy, WhoseLastChunkIsTooRoughToBeQueuedWholeIsNotSaidToHaveSucceeded) {
  PolicyRun run;
  bool sent = false;
  run.follow({{"policy", "outside"}, {"seconds", 30}}, [&](Time now) {
    task::ChunkStream* const stream = run.cell->above->cell().stream;
    if (stream == nullptr || sent || now < Time(from_s(1))) return;
    Chunk chunk = chunk_of(run, 0, 200, 0);
    chunk.period = std::chrono::milliseconds(20);
    for (std::size_t j = 0; j < chunk.actions.size(); ++j) chunk.actions[j].array() += j % 2 == 0 ? 0.05 : -0.05;
    chunk.last = true;
    const auto taken = stream->take(chunk, now);
    ASSERT_TRUE(taken) << taken.error().line();
    sent = true;
  });
  EXPECT_EQ(run.outcome, task::Outcome::kFailed);
  EXPECT_EQ(run.reason, "the limits make the last chunk too slow to be queued whole");
  EXPECT_GE(run.told("executed"), 3);
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 0u);
  run.expect_no_limit_broken();
}

TEST(Policy, WhoseChunksAreRefusedDoesNotMoveTheArm) {
  PolicyRun run;
  std::vector<std::string> named;
  run.follow({{"policy", "outside"}, {"seconds", 30}}, [&](Time now) {
    task::ChunkStream* const stream = run.cell->above->cell().stream;
    if (stream == nullptr || now < Time(from_s(1)) || !named.empty()) return;
    const auto name_of = [&](const Chunk& chunk) {
      const auto taken = stream->take(chunk, now);
      named.push_back(taken ? "taken" : taken.error().where);
    };
    name_of(chunk_of(run, 1, 20, 0.1));
    Chunk chunk = chunk_of(run, 0, 20, 0.1);
    chunk.actions[7].conservativeResize(6);
    name_of(chunk);
    chunk = chunk_of(run, 0, 20, 9);
    name_of(chunk);
    // Down into the belt.
    chunk = chunk_of(run, 0, 20, 0);
    for (AxisVector& action : chunk.actions) action[1] += 0.6;
    name_of(chunk);
  });
  EXPECT_EQ(named, (std::vector<std::string>{"chunk_future", "chunk_size", "chunk_position", "chunk_not_clear"}));
  EXPECT_EQ(run.outcome, task::Outcome::kFailed);
  EXPECT_EQ(run.reason, "no chunk came for 10 s");
  EXPECT_EQ(run.told("refused"), 4);
  EXPECT_LT(run.cell->body->arms.front()->cerebellum->statistics().commanded.speed, 1e-12);
  run.expect_no_limit_broken();
}

// While somebody is near, the arm is slow; so it executes fewer actions than the clock would have it, and each in its
// place.
TEST(Policy, SlowedByAZoneKeepsItsPlaceInTheStream) {
  PolicyRun run("parcel_cell", {{.zone = 0, .from = Time(from_s(4)), .stays = from_s(4)}});
  double off = 0;
  run.follow({{"policy", "outside"}, {"seconds", 10}}, [&](Time now) {
    task::ChunkStream* const stream = run.cell->above->cell().stream;
    if (stream == nullptr || now < Time(from_s(1))) return;
    const double executed = stream->observe(now).executed;
    const double at = run.cell->body->arms.front()->cerebellum->state().commanded.position[0] - run.world.robot.home[0];
    off = std::max(off, std::abs(at - sway(executed)));
    if (now.ns() % std::chrono::nanoseconds(std::chrono::milliseconds(200)).count() != 0) return;
    const auto taken = stream->take(swaying(run, executed, 20), now);
    ASSERT_TRUE(taken || taken.error().where == "chunk_stopped") << taken.error().line();
  });
  EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
  std::printf("slowed for 4 of 10 s: %s, at most %.4f rad out of place\n", run.detail.dump().c_str(), off);
  EXPECT_LT(run.told("executed"), 190);
  EXPECT_GT(run.told("executed"), 120);
  EXPECT_EQ(run.told("starved_ticks"), 0);
  EXPECT_LT(off, 0.01);
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 0u);
  run.expect_no_limit_broken();
}

// ---- stops ----

TEST(Policy, GoesOnAfterAStopButNotWithWhatItSawBefore) {
  PolicyRun run;
  std::string stale;
  run.follow({{"policy", "hover"}, {"seconds", 14}, {"latency_s", 0.3}}, [&](Time now) {
    skills::Cell& cell = run.cell->above->cell();
    if (now == Time(from_s(10))) cell.arm.halt();
    if (now == Time(from_s(12))) {
      ASSERT_TRUE(cell.arm.operational());
      const auto taken = cell.stream->take(chunk_of(run, 1, 200 / 4, 0.1), now);
      stale = taken ? "taken" : taken.error().where;
    }
  });
  EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
  EXPECT_EQ(stale, "chunk_stale");
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 1u);
  EXPECT_GE(run.told("executed"), 200);
  EXPECT_GE(run.over_it, 20);
  EXPECT_LT(run.worst_height_m, 0.2);
  run.expect_no_limit_broken();
}

// Somebody in the aisle makes the motion late, and then stops it in the gate, from where on nothing is late any more:
// asked at the clock's time the stopped motion would seem to have got further than the arm.
TEST(Policy, StoppedWhileItIsLateCountsOnlyWhatItDid) {
  PolicyRun run("parcel_cell", {{.zone = 0, .from = Time(from_s(2)), .stays = from_s(3)},
                                {.zone = 1, .from = Time(from_s(5)), .stays = from_s(0.5)}});
  double did = 0, on = 0, leap = 0;
  Duration late{0};
  bool was_stopped = false;
  // Whoever visits the bridge looks before the skill has noticed.
  run.first = [&](Time now) {
    if (run.stream() == nullptr || did == 0 || on > 0) return;
    run.arm().refresh(now);
    if (!run.arm().operational()) leap = std::max(leap, std::abs(run.stream()->observe(now).executed - did));
  };
  run.follow({{"policy", "outside"}, {"seconds", 12}}, [&](Time now) {
    if (run.stream() == nullptr || now < Time(from_s(1))) return;
    const double executed = run.stream()->observe(now).executed;
    if (!run.arm().operational()) {
      was_stopped = was_stopped || did > 0;
      return;
    }
    if (!was_stopped) {
      did = executed;
      late = run.arm().late();
    }
    if (now.ns() % std::chrono::nanoseconds(std::chrono::milliseconds(200)).count() != 0) return;
    const auto taken = run.stream()->take(swaying(run, executed, 20), now);
    ASSERT_TRUE(taken || taken.error().where == "chunk_stopped") << taken.error().line();
    if (taken && was_stopped && on == 0) on = executed;
  });
  std::printf("stopped %.2f s late after %.2f actions, goes on at %.2f\n", to_s(late), did, on);
  EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 1u);
  EXPECT_GT(late, from_s(0.3));
  EXPECT_LT(leap, 1e-9);
  // Above what was observed before, and the action under way is not said to have been executed.
  EXPECT_GT(on, did);
  EXPECT_LT(on, std::floor(did) + 1);
  run.expect_no_limit_broken();
}

TEST(Policy, StoppedWhileItsLastChunkIsLateHasNotSucceeded) {
  PolicyRun run("parcel_cell", {{.zone = 0, .from = Time(from_s(1.5)), .stays = from_s(6)},
                                {.zone = 1, .from = Time(from_s(5.8)), .stays = from_s(0.5)}});
  double did = 0;
  Duration late{0};
  bool sent = false;
  run.follow({{"policy", "outside"}, {"seconds", 40}}, [&](Time now) {
    if (run.stream() == nullptr || now < Time(from_s(1))) return;
    if (run.arm().operational() && run.cell->body->arms.front()->cerebellum->statistics().stops == 0) {
      did = run.stream()->observe(now).executed;
      late = run.arm().late();
    }
    if (sent) return;
    Chunk chunk = swaying(run, 0, 80);
    chunk.last = true;
    const auto taken = run.stream()->take(chunk, now);
    ASSERT_TRUE(taken) << taken.error().line();
    sent = true;
  });
  std::printf("stopped %.2f s late after %.2f of 80 actions: %s\n", to_s(late), did, run.detail.dump().c_str());
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 1u);
  EXPECT_LT(did, 79);
  EXPECT_GT(did + to_s(late) / 0.05, 80);  // at the clock's time all would seem to have been executed
  EXPECT_EQ(run.outcome, task::Outcome::kFailed);
  EXPECT_EQ(run.reason, "no chunk came for 10 s");
  EXPECT_EQ(run.told("executed"), std::floor(did));
  run.expect_no_limit_broken();
}

// A stop ends no stream: whoever has said its last can say the rest of it.
TEST(Policy, StoppedInItsLastChunkSendsTheRest) {
  for (const double stop_at : {7.4, 19.2}) {
    PolicyRun run;
    double did = 0, on = 0;
    int sent = 0;
    run.follow({{"policy", "outside"}, {"seconds", 40}}, [&](Time now) {
      if (run.stream() == nullptr || now < Time(from_s(1)) || !run.arm().operational()) return;
      const double executed = run.stream()->observe(now).executed;
      const bool stopped = run.cell->body->arms.front()->cerebellum->statistics().stops > 0;
      if (sent == 1 && !stopped) {
        did = executed;
        if (executed >= stop_at) run.arm().halt();
      } else if (sent == 0 || (sent == 1 && stopped)) {
        Chunk chunk{.observed = executed, .period = std::chrono::milliseconds(50)};
        for (double n = executed + 1; n < 21; ++n)
          chunk.actions.emplace_back(run.world.robot.home.array() + 0.1 * std::min(1.0, n / 20));
        chunk.last = true;
        const auto taken = run.stream()->take(chunk, now);
        if (!taken && taken.error().where == "chunk_stopped") return;
        ASSERT_TRUE(taken) << taken.error().line();
        if (++sent == 2) on = executed;
      }
    });
    std::printf("stopped after %.2f of 20 actions, goes on at %.2f: %s\n", did, on, run.detail.dump().c_str());
    EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 1u);
    EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
    EXPECT_GT(on, did);
    EXPECT_LT(on, std::floor(did) + 1);
    EXPECT_EQ(run.told("executed"), 20);
    EXPECT_EQ(run.told("chunks"), 2);
    const AxisVector end = run.world.robot.home.array() + 0.1;
    EXPECT_TRUE(run.cell->body->arms.front()->cerebellum->state().commanded.position.isApprox(end, 1e-9));
    run.expect_no_limit_broken();
  }
}

// However often, and though the last action ends between two whole numbers: what was never done does not count.
TEST(Policy, StoppedInItsLastChunkAndSilentFailsForThat) {
  for (const double stop_at : {7.4, 19.2, 20.2}) {
    PolicyRun run;
    int sent = 0, halts = 0, follows = 0;
    double did = 0, on = 0, total = 20;
    run.follow({{"policy", "outside"}, {"seconds", 60}}, [&](Time now) {
      if (run.stream() == nullptr || now < Time(from_s(1))) return;
      follows = run.arm().operational() ? follows + 1 : 0;
      if (follows == 0) return;
      const double executed = run.stream()->observe(now).executed;
      const auto stops = static_cast<int>(run.cell->body->arms.front()->cerebellum->statistics().stops);
      if (stops == 0) did = executed;
      if (sent == 0 || (sent == 1 && executed >= 2.5)) {
        Chunk chunk = chunk_of(run, executed, 20 - 2 * static_cast<std::size_t>(sent), 0.1);
        chunk.last = true;
        const auto taken = run.stream()->take(chunk, now);
        ASSERT_TRUE(taken) << taken.error().line();
        ++sent;
        total = executed + static_cast<double>(chunk.actions.size());
      } else if (executed >= stop_at && halts == stops && halts < 3 && follows > 10) {
        if (halts > 1) {
          EXPECT_NEAR(executed, on, 1e-7) << "nothing was done in between, and nothing counts";
          const auto old = run.stream()->take(chunk_of(run, on, 2, 0.1), now);
          ASSERT_FALSE(old) << "what was observed before a stop";
          EXPECT_EQ(old.error().where, "chunk_stale");
        }
        on = executed;
        run.arm().halt();
        ++halts;
      }
    });
    std::printf("stopped after %.3f of %.3f actions, and at %.3f again\n", did, total, on);
    EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 3u);
    EXPECT_LT(on, std::min(total, std::floor(did) + 1));
    EXPECT_EQ(run.outcome, task::Outcome::kFailed);
    EXPECT_EQ(run.reason, "no chunk came for 10 s");
    EXPECT_EQ(run.told("executed"), std::floor(stop_at));
    run.expect_no_limit_broken();
  }
}

// Stopped when nothing is left of it but to notice that.
TEST(Policy, StoppedAtTheVeryEndOfItsLastChunkHasSucceeded) {
  int ended = 0;
  for (std::size_t count = 20; count < 30 && ended == 0; ++count) {
    PolicyRun run;
    bool sent = false;
    run.follow({{"policy", "outside"}, {"seconds", 60}}, [&](Time now) {
      if (run.stream() == nullptr || now < Time(from_s(1))) return;
      if (!sent) {
        Chunk chunk = chunk_of(run, 0, count, 0.1);
        chunk.last = true;
        const auto taken = run.stream()->take(chunk, now);
        ASSERT_TRUE(taken) << taken.error().line();
        sent = true;
      } else if (ended == 0 && run.stream()->observe(now).executed >= static_cast<double>(count) - 1e-6) {
        run.arm().halt();
        ++ended;
      }
    });
    EXPECT_EQ(run.outcome, task::Outcome::kSucceeded) << run.reason;
    EXPECT_EQ(run.told("executed"), count);
    EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, static_cast<std::uint64_t>(ended));
  }
  EXPECT_EQ(ended, 1);
}

TEST(Policy, CancelledComesToRestAlongItsWay) {
  PolicyRun run;
  run.follow({{"policy", "hover"}, {"seconds", 30}}, [&](Time now) {
    if (now == Time(from_s(11))) run.cell->above->bridge_side->stop(now, "test");
  });
  EXPECT_EQ(run.outcome, task::Outcome::kCancelled) << run.reason;
  EXPECT_LT(run.now, Time(from_s(12.5)));
  EXPECT_TRUE(run.cell->body->arms.front()->cerebellum->state().commanded.speed.isZero(1e-9));
  EXPECT_EQ(run.cell->body->arms.front()->cerebellum->statistics().stops, 0u);
  run.expect_no_limit_broken();
}

}  // namespace
}  // namespace pons::tests
