#include "tests/end_to_end/task_run.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

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

world::World small_cell_with_block(const std::string& robot_lines) {
  const fs::path worlds = fs::path(testing::TempDir()) /
                          (testing::UnitTest::GetInstance()->current_test_info()->name() + std::string("_worlds"));
  fs::remove_all(worlds);
  fs::copy(PONS_WORLDS_SOURCE, worlds, fs::copy_options::recursive);
  put_in(worlds / "small_cell" / "world.yaml", "  - {name: tray, kind: tray",
         "  - {name: block, kind: region, center: [-0.40, -0.82, 0.66], size: [0.20, 0.20, 0.08]}\n");
  put_in(worlds / "small_cell" / "world.yaml", "  payload_kg:", robot_lines);
  put_in(worlds / "small_cell" / "scene.xml", "    <geom name=\"floor\"",
         "    <geom name=\"block\" pos=\"-0.40 -0.82 0.66\" size=\"0.1 0.1 0.04\"/>\n");
  auto world = world::load(worlds, "small_cell");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

TaskRun::TaskRun(world::World world)
    : world_(std::move(world)),
      cell_(
          apps::Assembly::build(world_, world::draw_manifest(world_, 1, 1).value(), {.journal = ":memory:"}).value()) {}

void TaskRun::run(const std::string& skill, const std::string& arguments, const std::function<void(Time)>& each_tick) {
  ASSERT_TRUE(cell_->above->bridge->submit(
      R"({"id":"one","steps":[{"skill":")" + skill + R"(","arguments":)" + arguments + "}]}", Time{}));
  runner::Parts parts = cell_->parts();
  body::Sensors sensors;
  body::SetPoints set_points;
  for (Time now = Time(runner::kControlPeriod); now < Time(from_s(40)); now += runner::kControlPeriod) {
    parts.body.plant.advance(now);
    parts.body.plant.body->read(sensors);
    parts.body.photographer->open_shutters(now, sensors);
    cell_->body->cerebellum->step(now, sensors, *parts.body.link, set_points);
    parts.body.plant.body->write(set_points);
    each_tick(now);
    if (now.ns() % runner::kBridgePeriod.count() != 0) continue;
    const auto ticked = parts.bridge_side->tick(now, *parts.observer);
    ASSERT_TRUE(ticked) << ticked.error().line();
    const auto task = cell_->above->journal->task("one");
    ASSERT_TRUE(task && *task);
    if (const auto& ended = (*task)->record.outcome) {
      outcome = ended->outcome;
      reason = ended->reason;
      return;
    }
  }
}

}  // namespace pons::tests
