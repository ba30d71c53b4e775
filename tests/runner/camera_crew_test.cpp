// The camera crew with the real cameras of a simulated cell and the real perception behind it.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <latch>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "pons/core/digest.hpp"
#include "pons/perception/perception.hpp"
#include "pons/runner/darkroom.hpp"
#include "pons/runner/observer.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/world/manifest.hpp"

namespace pons::runner {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(1);
constexpr int kTicksABridgePeriod = 10;

world::World load() {
  auto world = world::load("worlds", "small_cell");
  EXPECT_TRUE(world) << world.error().line();
  return std::move(*world);
}

class CountingCamera final : public body::Camera {
 public:
  explicit CountingCamera(body::Camera& camera) : camera_(camera) {}
  [[nodiscard]] const Intrinsics& intrinsics() const override { return camera_.intrinsics(); }
  void begin(Time now) override {
    ++shutters;
    opened.insert(now);
    camera_.begin(now);
  }
  [[nodiscard]] Expected<void> finish(RgbdFrame& frame) override {
    auto finished = camera_.finish(frame);
    if (covered) std::fill_n(frame.depth_m.data(), frame.depth_m.size(), 0.0F);
    return finished;
  }
  std::atomic<bool> covered = false;
  int shutters = 0;
  std::set<Time> opened;

 private:
  body::Camera& camera_;
};

// A cell whose parcels ride by; the arm stands.
struct Scene {
  explicit Scene(world::World the_world = load()) : world(std::move(the_world)) {
    const auto manifest = world::draw_manifest(world, 4, 1);
    EXPECT_TRUE(manifest) << manifest.error().line();
    auto created = sim::Simulation::create(world, *manifest, 1);
    EXPECT_TRUE(created) << created.error().line();
    simulation = std::move(*created);
    simulation->run_belt();
    perception.emplace(world, model::RobotModel::load(world.robot).value());
    for (body::Camera* const camera : simulation->cameras()) cameras.emplace_back(*camera);
    std::vector<body::Camera*> counted;
    for (CountingCamera& camera : cameras) counted.push_back(&camera);
    photographer.emplace(world, counted, room.frames, room.pages, room.memory(), Pace::kLockstep);
    observer.emplace(world, *perception, room.frames, room.pages, room.memory(), Pace::kLockstep);
  }

  // A bridge period of physics and shutters, then what the crew has to say.
  std::optional<Snapshot> period(const std::vector<std::uint32_t>& forgotten = {}) {
    for (int i = 0; i < kTicksABridgePeriod; ++i) {
      now += kTick;
      simulation->advance_to(now);
      simulation->body().read(sensors);
      travel_m[now] = sensors.belt_travel_m;
      photographer->open_shutters(now, {&sensors, 1});
    }
    EXPECT_TRUE(photographer->health());
    return observer->collect(now, forgotten);
  }

  world::World world;
  std::unique_ptr<sim::Simulation> simulation;
  std::optional<perception::Perception> perception;
  std::deque<CountingCamera> cameras;  // in the world's order
  Darkroom room{world};
  std::optional<Photographer> photographer;
  std::optional<Observer> observer;
  body::Sensors sensors;
  std::map<Time, double> travel_m;
  Time now;
};

Duration latency(const world::World& world, std::string_view watches) {
  const auto camera = std::ranges::find(world.cameras, watches, &world::CameraSpec::watches);
  return from_s(camera->latency_s);
}

TEST(CameraCrew, NothingIsKnownBeforeItsLatencyHasPassed) {
  Scene scene;
  std::vector<Snapshot> snapshots;
  for (int i = 0; i < 300; ++i) {
    const auto snapshot = scene.period();
    if (!snapshot) continue;
    EXPECT_LE(snapshot->due, scene.now);
    EXPECT_GT(snapshot->due, scene.now - kTicksABridgePeriod * kTick) << "and not later than it must be";
    EXPECT_GE(snapshot->due, snapshot->stamp + latency(scene.world, "belt"));
    EXPECT_EQ(snapshot->belt_travel_m, scene.travel_m.at(snapshot->stamp)) << "as it was when the shutter was open";
    EXPECT_TRUE(snapshots.empty() || snapshot->stamp > snapshots.back().stamp);
    snapshots.push_back(*snapshot);
  }
  // Five frames a second from the quick stream alone.
  EXPECT_GE(snapshots.size(), 14U);
  EXPECT_TRUE(std::ranges::any_of(snapshots, [](const Snapshot& s) { return !s.objects.empty(); }));
  EXPECT_EQ(snapshots.back().occupancy.at("tray"), 0);
}

// Who takes over waits for pictures of what is there.
TEST(CameraCrew, WhatACoveredCameraShowsWasNotSeen) {
  Scene scene;
  const auto runs = [&](int periods) {
    Time seen;
    for (int i = 0; i < periods; ++i) {
      if (const auto snapshot = scene.period()) seen = snapshot->belt_seen;
    }
    return seen;
  };
  const Time seen = runs(100);
  EXPECT_GT(seen, Time(std::chrono::milliseconds(500)));
  for (CountingCamera& camera : scene.cameras) camera.covered = true;
  const Time covered_at = scene.now;
  EXPECT_LE(runs(100), covered_at + std::chrono::milliseconds(200)) << "but for those that were on their way";
  for (CountingCamera& camera : scene.cameras) camera.covered = false;
  EXPECT_GT(runs(100), covered_at + std::chrono::seconds(1));
}

TEST(CameraCrew, LabelsArePhotographedOnlyWhileSomethingLiesUnread) {
  Scene scene;
  const auto reads = std::ranges::find(scene.world.cameras, true, &world::CameraSpec::reads_labels);
  const CountingCamera& label = scene.cameras[static_cast<std::size_t>(reads - scene.world.cameras.begin())];
  const auto none_seen = [](const std::optional<Snapshot>& snapshot) { return !snapshot || snapshot->objects.empty(); };
  while (none_seen(scene.period()) && scene.now < Time(std::chrono::seconds(30))) {
    EXPECT_EQ(label.shutters, 0) << "at an empty belt";
  }
  std::set<std::string> codes;
  const Time found = scene.now, until = found + std::chrono::seconds(10);
  while (scene.now < until) {
    const auto snapshot = scene.period();
    if (none_seen(snapshot)) continue;
    for (const ObjectBelief& object : snapshot->objects) codes.insert(object.code);
  }
  codes.erase("");
  EXPECT_GE(codes.size(), 2u);
  const auto turns = static_cast<int>(to_s(until - found) / reads->period_s);
  EXPECT_GE(label.shutters, static_cast<int>(codes.size()));
  EXPECT_LT(label.shutters, turns) << "what is read twice is sure";
}

// Both hang in one place. In that cell their turns are apart, so both take each of theirs.
TEST(CameraCrew, OfTwoStreamsOfOneCameraWithOneTurnTheOneThatReadsTakesIt) {
  world::World world = load();
  const auto place = [&](bool reads) {
    return std::ranges::find(world.cameras, reads, &world::CameraSpec::reads_labels) - world.cameras.begin();
  };
  const auto finds = static_cast<std::size_t>(place(false)), reads = static_cast<std::size_t>(place(true));
  world.cameras[reads].phase_s = world.cameras[finds].phase_s;
  const Duration period = from_s(world.cameras[finds].period_s);
  for (const double off_m : {0.0, 0.01}) {
    world.cameras[reads].world_from_optical.translation().x() += off_m;
    Scene scene(world);
    while (scene.now < Time(std::chrono::seconds(12))) (void)scene.period();
    const std::set<Time>&found = scene.cameras[finds].opened, &read = scene.cameras[reads].opened;
    ASSERT_GT(read.size(), 2U);
    for (Time turn(period); turn < scene.now; turn += period)
      EXPECT_TRUE(found.contains(turn) != (off_m == 0 && read.contains(turn))) << to_s(turn - Time{}) << " s";
  }
}

TEST(CameraCrew, TheSameSceneGivesTheSameBeliefsWheneverTheThreadRuns) {
  const auto digest = [] {
    Scene scene;
    Digest all;
    for (int i = 0; i < 200; ++i) {
      const auto snapshot = scene.period();
      if (!snapshot) continue;
      all.add(scene.now.ns());
      for (const ObjectBelief& object : snapshot->objects) {
        all.add(object.track);
        all.add(std::span<const double>(object.world_from_top.matrix().data(), 16));
        all.add(object.code);
      }
    }
    return all.value();
  };
  EXPECT_EQ(digest(), digest());
}

// Where a bridge is killed within a run: what it had not looked at is gone, and the next one sees the same each time.
TEST(CameraCrew, WhileNobodyLooksTheCamerasSkipTheirTurns) {
  const auto digest = [] {
    Scene scene;
    for (int i = 0; i < 100; ++i) (void)scene.period();
    scene.observer.reset();
    scene.photographer->nobody_looks();
    const int shutters = scene.cameras.front().shutters;
    for (int i = 0; i < 100 * kTicksABridgePeriod; ++i) {
      scene.now += kTick;
      scene.simulation->advance_to(scene.now);
      scene.photographer->open_shutters(scene.now, {&scene.sensors, 1});
    }
    EXPECT_EQ(scene.cameras.front().shutters, shutters);
    const Time came = scene.now;
    scene.perception.emplace(scene.world, model::RobotModel::load(scene.world.robot).value());
    scene.observer.emplace(scene.world, *scene.perception, scene.room.frames, scene.room.pages, scene.room.memory(),
                           Pace::kLockstep);
    scene.photographer->somebody_looks();
    Digest all;
    for (int i = 0; i < 100; ++i) {
      const auto snapshot = scene.period();
      if (!snapshot) continue;
      EXPECT_GT(snapshot->stamp, came);
      all.add(snapshot->stamp.ns());
      for (const ObjectBelief& object : snapshot->objects)
        all.add(std::span<const double>(object.world_from_top.matrix().data(), 16));
    }
    EXPECT_GT(scene.cameras.front().shutters, shutters);
    return all.value();
  };
  EXPECT_EQ(digest(), digest());
}

TEST(CameraCrew, PassesOnWhatWasTakenOffTheBelt) {
  Scene scene;
  std::optional<std::uint32_t> track;
  for (int i = 0; i < 400 && !track; ++i) {
    const auto snapshot = scene.period();
    if (snapshot && !snapshot->objects.empty()) track = snapshot->objects.front().track;
  }
  ASSERT_TRUE(track);
  const Time told = scene.now;
  std::optional<Snapshot> later = scene.period({*track});
  while (!later || later->stamp <= told) later = scene.period();
  EXPECT_TRUE(std::ranges::none_of(later->objects, [&](const ObjectBelief& o) { return o.track == *track; }));
}

// A camera that takes its time, and may break.
class SlowCamera final : public body::Camera {
 public:
  [[nodiscard]] const Intrinsics& intrinsics() const override { return intrinsics_; }
  void begin(Time) override { ++begun; }
  [[nodiscard]] Expected<void> finish(RgbdFrame&) override {
    develop.wait();
    return fail("the lens is off", "overhead", "put it on");
  }
  std::latch develop{1};
  int begun = 0;

 private:
  Intrinsics intrinsics_;
};

TEST(CameraCrew, InRealTimeABusyCameraSkipsAFrameAndAFailedOneEndsTheRun) {
  world::World world = load();
  world.cameras.resize(1);
  SlowCamera camera;
  perception::Perception perception(world, model::RobotModel::load(world.robot).value());
  Darkroom room(world);
  Photographer photographer(world, {&camera}, room.frames, room.pages, room.memory(), Pace::kRealTime);
  Observer observer(world, perception, room.frames, room.pages, room.memory(), Pace::kRealTime);
  const Time first(from_s(world.cameras[0].phase_s)), second = first + from_s(world.cameras[0].period_s);
  const body::Sensors sensors;
  photographer.open_shutters(first, {&sensors, 1});
  photographer.open_shutters(second, {&sensors, 1});
  EXPECT_EQ(camera.begun, 1) << "the second frame was skipped, and nobody waited";
  EXPECT_FALSE(observer.collect(second, {}));

  EXPECT_TRUE(photographer.health());
  camera.develop.count_down();
  while (photographer.health()) {
  }
  EXPECT_EQ(photographer.health().error().what, "the lens is off");
}

}  // namespace
}  // namespace pons::runner
