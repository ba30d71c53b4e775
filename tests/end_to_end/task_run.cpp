#include "tests/end_to_end/task_run.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

#include "pons/runner/ending.hpp"

namespace pons::tests {
namespace {

namespace fs = std::filesystem;

void put_in(const fs::path& file, const std::string& before, const std::string& line) {
  std::ifstream in(file);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto at = text.find(before);
  ASSERT_NE(at, std::string::npos) << before;
  std::ofstream(file) << text.insert(at, line);
}

}  // namespace

world::World small_cell(const std::string& robot_lines) {
  std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
  std::ranges::replace(name, '/', '_');  // of a test with a parameter
  const fs::path worlds = fs::path(testing::TempDir()) / (name + "_worlds");
  fs::remove_all(worlds);
  fs::copy(PONS_WORLDS_SOURCE, worlds, fs::copy_options::recursive);
  put_in(worlds / "small_cell" / "world.yaml", "  payload_kg:", robot_lines);
  auto world = world::load(worlds, "small_cell");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

TaskRun::TaskRun(world::World world, std::int64_t parcels, std::uint64_t seed)
    : world_(std::move(world)),
      cell_(apps::Assembly::build(world_, world::draw_manifest(world_, parcels, seed).value(),
                                  {.journal = ":memory:", .body = {.seed = seed}})
                .value()),
      parts_(cell_->parts()),
      sensors_(parts_.body.robots.size()),
      set_points_(parts_.body.robots.size()) {}

void TaskRun::step() {
  now_ += runner::kControlPeriod;
  parts_.body.plant.advance(now_);
  std::vector<runner::RobotParts>& robots = parts_.body.robots;
  for (std::size_t i = 0; i < robots.size(); ++i) robots[i].body->read(sensors_[i]);
  parts_.body.photographer->open_shutters(now_, sensors_);
  for (std::size_t i = 0; i < robots.size(); ++i) {
    robots[i].cerebellum->step(now_, sensors_[i], *robots[i].link, set_points_[i]);
    robots[i].body->write(set_points_[i]);
  }
  if (now_.ns() % runner::kBridgePeriod.count() != 0) return;
  const auto ticked = parts_.bridge_side->tick(now_, *parts_.observer);
  ASSERT_TRUE(ticked) << ticked.error().line();
}

void TaskRun::run(const std::string& skill, const std::string& arguments, const std::function<void(Time)>& each_tick) {
  ASSERT_TRUE(
      bridge().submit(R"({"id":"one","steps":[{"skill":")" + skill + R"(","arguments":)" + arguments + "}]}", now_));
  await("one", from_s(40), each_tick);
}

void TaskRun::await(const std::string& id, Duration longest, const std::function<void(Time)>& each_tick) {
  const Time end = now_ + longest;
  while (now_ < end && !testing::Test::HasFatalFailure()) {
    step();
    each_tick(now_);
    if (now_.ns() % runner::kBridgePeriod.count() != 0) continue;
    const auto task = journal().task(id);
    ASSERT_TRUE(task) << task.error().line();
    if (!*task || !(*task)->record.outcome) continue;
    const bridge::OutcomeRecord& ended = *(*task)->record.outcome;
    outcome = ended.outcome;
    reason = ended.reason;
    detail = ended.detail;
    return;
  }
  FAIL() << id << " has no outcome after " << to_s(longest) << " s";
}

bool TaskRun::finish(const std::function<void(Time)>& each_tick) {
  const runner::Watch watch{.limit = now_ + std::chrono::minutes(10)};
  runner::Ending ending(watch, *parts_.bridge_side);
  do {
    step();
    each_tick(now_);
    if (testing::Test::HasFatalFailure()) return false;
  } while (now_.ns() % runner::kBridgePeriod.count() != 0 || !ending.check(now_, parts_.body.plant.finished()));
  parts_.bridge_side->close(now_);
  return ending.broken_off().empty();
}

}  // namespace pons::tests
