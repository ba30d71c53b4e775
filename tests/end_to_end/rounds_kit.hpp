// A base on its rounds, in lockstep, with a look at where it really is in each tick: for tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>

#include "apps/rounds.hpp"
#include "pons/referee/rounds.hpp"
#include "pons/sim/truth.hpp"

namespace pons::tests {

namespace fs = std::filesystem;
using task::Json;
using task::Outcome;

inline std::string text_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

class RoundsTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "speech");
    fs::copy(PONS_WORLDS_SOURCE, folder_ / "worlds", fs::copy_options::recursive);
  }
  void TearDown() override {
    rounds_.reset();
    fs::remove_all(folder_);
  }

  // In the world's own copy of a file, before begin().
  void change(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = text_of(folder_ / "worlds" / "rounds" / file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    std::ofstream(folder_ / "worlds" / "rounds" / file) << text.replace(at, from.size(), to);
  }
  void put_there(const std::string& name, const std::string& at, const std::string& half_size) {
    change("scene.xml", "  </worldbody>",
           "<geom name=\"" + name + "\" pos=\"" + at + "\" size=\"" + half_size + "\"/>\n  </worldbody>");
  }

  void begin(std::uint64_t seed = 1) {
    auto world = world::load(folder_ / "worlds", "rounds");
    ASSERT_TRUE(world) << world.error().line();
    auto built = apps::Rounds::build(std::move(*world), {},
                                     {.seed = seed, .journal = ":memory:", .socket = {}, .speech = folder_ / "speech"});
    ASSERT_TRUE(built) << built.error().line();
    rounds_ = std::move(*built);
    parts_ = rounds_->parts();
  }

  void step() {
    now_ += runner::kControlPeriod;
    parts_.body.plant.advance(now_);
    parts_.body.robots.front().body->read(sensors_);
    if (!lidar_is_silent_) parts_.body.photographer->open_shutters(now_, {&sensors_, 1});
    rounds_->cerebellum->step(now_, sensors_, *parts_.body.robots.front().link, set_points_);
    parts_.body.robots.front().body->write(set_points_);
    if (now_.ns() % runner::kBridgePeriod.count() != 0) return;
    const auto ticked = parts_.bridge_side->tick(now_, *parts_.observer);
    ASSERT_TRUE(ticked) << ticked.error().line();
  }
  void submit(const std::string& task) {
    const auto admitted = rounds_->bridge->submit(task, now_);
    ASSERT_TRUE(admitted) << admitted.error().line();
  }
  void drive(const std::string& id, const std::string& arguments, int priority = 50) {
    submit(R"({"id":")" + id + R"(","priority":)" + std::to_string(priority) +
           R"(,"steps":[{"skill":"navigate","params":)" + arguments + "}]}");
  }
  void run_until(const std::function<bool()>& done, double longest_s = 120) {
    const Time end = now_ + from_s(longest_s);
    while (!done() && !HasFatalFailure()) {
      ASSERT_LT(now_, end) << "it takes too long";
      step();
    }
  }
  void run_for(double seconds) {
    const Time end = now_ + from_s(seconds);
    while (now_ < end && !HasFatalFailure()) step();
  }
  [[nodiscard]] bridge::TaskHistory history(const std::string& id) {
    auto found = rounds_->journal->task(id);
    EXPECT_TRUE(found && *found) << id;
    return found && *found ? **found : bridge::TaskHistory{};
  }
  [[nodiscard]] bool ended(const std::string& id) {
    const auto found = rounds_->journal->task(id);
    return found && *found && (*found)->record.outcome;
  }
  void await(const std::string& id, double longest_s = 180) {
    run_until([&] { return now_.ns() % 100'000'000 == 0 && ended(id); }, longest_s);
  }
  [[nodiscard]] Outcome outcome(const std::string& id) { return history(id).record.outcome->outcome; }
  [[nodiscard]] std::string reason(const std::string& id) { return history(id).record.outcome->reason; }
  // What the last step of a task has told.
  [[nodiscard]] Json told(const std::string& id) {
    Json detail;
    for (const bridge::Event& event : history(id).events) {
      if (event.kind == "attempt_ended") detail = event.detail.at("detail");
    }
    return detail;
  }
  [[nodiscard]] const sim::BaseTruth& truth() const { return sim::truth_of(*rounds_->simulation); }
  [[nodiscard]] Pose2 place() const { return truth().way.lately().back().map_from_base; }
  [[nodiscard]] double speed_m_s() const {
    const auto& way = truth().way.lately();
    return (way.back().map_from_base.position() - way[way.size() - 2].map_from_base.position()).norm() / 0.01;
  }
  void expect_at(const Pose2& goal) {
    EXPECT_LE((place().position() - goal.position()).norm(), 0.05);
    EXPECT_LE(std::abs(wrapped(place().yaw - goal.yaw)), 0.05);
  }
  // Every goal reached in truth, nothing touched, no limit broken.
  void expect_good() {
    referee::RoundsRules rules{.speed_m_s = rounds_->world.base->speed_m_s};
    for (const world::Station& station : rounds_->world.base->stations)
      rules.places[station.name] = station.map_from_base;
    const auto verdict = referee::judge_rounds(truth(), *rounds_->journal, rules);
    ASSERT_TRUE(verdict);
    EXPECT_EQ(verdict->missed, 0) << testing::PrintToString(verdict->findings);
    EXPECT_EQ(verdict->collisions, 0) << truth().touched;
    EXPECT_FALSE(verdict->too_fast) << verdict->fastest_m_s;
    EXPECT_EQ(rounds_->cerebellum->statistics().violations, 0U);
    EXPECT_EQ(rounds_->cerebellum->statistics().refused, 0U);
  }

  fs::path folder_;
  std::unique_ptr<apps::Rounds> rounds_;
  runner::Parts parts_;
  body::Sensors sensors_;
  body::SetPoints set_points_;
  bool lidar_is_silent_ = false;
  Time now_;
};

}  // namespace pons::tests
