// A bridge whose computer loses its power at every point of its work with the disk, again and again: what it told
// anybody is so, and nothing in the world is done twice.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/story.hpp"
#include "tests/crash/disk.hpp"

namespace pons::tests {
namespace {

using bridge::Bridge;
using bridge::Journal;
using task::Json;
using task::Outcome;

constexpr int kTasks = 6;
constexpr std::size_t kSteps = 2;
constexpr int kMostPowerOffs = 40;
constexpr std::int64_t kNever = 1'000'000;
constexpr Duration kPeriod = std::chrono::milliseconds(10);

// What is so, whatever a computer remembers.
struct World {
  std::map<std::pair<std::string, std::size_t>, int> done;  // task and step: how often
};

// Nobody pauses or halts these.
class Untold : public task::Skill {
 public:
  void pause(Time, task::Pause) final {}
  void resume(Time) final {}
  void halt(Time) final {}
};

// One step, done in its third tick. It looks first: what is done already, it does not do again.
class Work final : public Untold {
 public:
  Work(World& world, const Json& arguments)
      : done_(world.done[{arguments.at("task").get<std::string>(), arguments.at("step").get<std::size_t>()}]) {}
  task::Progress tick(Time) override {
    if (cancelled_) return {done_ > 0 ? task::Status::kSucceeded : task::Status::kFailed, "broken off"};
    if (done_ > 0) return {task::Status::kSucceeded};
    if (++ticks_ < 3) return {};
    ++done_;
    return {task::Status::kSucceeded};
  }
  void cancel(Time) override { cancelled_ = true; }

 private:
  int& done_;
  int ticks_ = 0;
  bool cancelled_ = false;
};

// The same without looking.
class BlindWork final : public Untold {
 public:
  BlindWork(World& world, const Json& arguments)
      : done_(world.done[{arguments.at("task").get<std::string>(), arguments.at("step").get<std::size_t>()}]) {}
  task::Progress tick(Time) override {
    if (++ticks_ < 3) return {};
    ++done_;
    return {task::Status::kSucceeded};
  }
  void cancel(Time) override {}

 private:
  int& done_;
  int ticks_ = 0;
};

std::string id_of(int number) { return fmt::format("t{}", number); }

Json task_of(int number) {
  Json steps = Json::array();
  for (std::size_t step = 0; step < kSteps; ++step)
    steps.push_back(
        {{"skill", step == 0 ? "blind" : "work"}, {"arguments", {{"task", id_of(number)}, {"step", step}}}});
  return {{"id", id_of(number)}, {"steps", steps}};
}

class Ordeal {
 public:
  Ordeal(std::uint64_t seed, Disk::Syncs syncs) : disk_(seed, syncs), random_(seed) {
    world_file_.resources = {{"arm"}};
    for (const bool looks : {true, false}) {
      skills_.add({.name = looks ? "work" : "blind",
                   .summary = "for tests",
                   .schema = Json::parse(R"({"type":"object"})"),
                   .resources = {"arm"},
                   .timeout = std::chrono::seconds(10),
                   .start = [this, looks](const Json& arguments, Time) -> std::unique_ptr<task::Skill> {
                     begun_.emplace(arguments.at("task").get<std::string>(), arguments.at("step").get<std::size_t>());
                     if (looks) return std::make_unique<Work>(world_, arguments);
                     return std::make_unique<BlindWork>(world_, arguments);
                   }});
    }
  }

  // The power goes first with the n-th operation of the disk, then at random. Everything that was not as promised.
  std::vector<std::string> run(std::int64_t first_power_off) {
    disk_.power_off_at(first_power_off);
    for (int power_offs = 0; power_offs < kMostPowerOffs; ++power_offs) {
      if (live()) return wrong_;
      disk_.restart();
      look_back();
      disk_.power_off_at(static_cast<std::int64_t>(1 + random_.below(120)));
    }
    // Enough of it: the last one may end.
    disk_.restart();
    if (!live()) wrong_.emplace_back("it does not end");
    return wrong_;
  }
  [[nodiscard]] std::int64_t operations() const { return disk_.operations(); }

 private:
  void wrong(std::string what) { wrong_.push_back(std::move(what)); }

  // From switching on until all is done (true) or the power goes.
  bool live() {
    auto journal = Journal::open("disk.db", disk_.vfs());
    if (!journal) {
      if (!disk_.off()) wrong("the journal does not open: " + journal.error().line());
      return !disk_.off();
    }
    Bridge bridge(**journal, skills_, world_file_);
    const auto look = [this](const task::Task& task, std::size_t done) -> bridge::Resumption {
      while (done < task.steps.size() && world_.done[{task.id, done}] > 0) ++done;
      return {.done = done};
    };
    if (!bridge.recover(look, now_)) return gone(bridge);
    for (int number = 0; number < kTasks; ++number) {
      if (!ask(bridge, number)) return gone(bridge);
    }
    for (int i = 0; i < 1000 && !bridge.idle(); ++i) {
      bridge.tick(now_ += kPeriod);
      for (const bridge::OutcomeReport& report : bridge.take_outcomes()) hear(report);
      if (i == 5) (void)bridge.cancel(id_of(kTasks - 1), now_, "not wanted");
      if (bridge.fault()) return gone(bridge);
    }
    if (!bridge.idle()) wrong("tasks stay open");
    journal->reset();
    if (disk_.off()) return false;
    disk_.power_off_at(kNever);
    look_back();
    all_is_done();
    return true;
  }

  bool gone(const Bridge& bridge) {
    if (!disk_.off()) wrong("a fault without a cause: " + (bridge.fault() ? bridge.fault()->line() : "none"));
    return !disk_.off();
  }

  // As a warehouse does that never knows whether it was heard. False: no power.
  bool ask(Bridge& bridge, int number) {
    const auto admitted = bridge.submit(task_of(number).dump(), now_);
    if (!admitted) {
      if (!disk_.off()) wrong(fmt::format("{} is refused: {}", id_of(number), admitted.error().line()));
      return false;
    }
    if (!bridge.commit(now_)) return false;
    accepted_.insert(id_of(number));
    return true;
  }

  void hear(const bridge::OutcomeReport& report) {
    const auto [told, first] = outcomes_.emplace(report.id, report.outcome);
    if (!first) wrong(fmt::format("{} has a second outcome", report.id));
  }

  // Whether the disk holds what was told.
  void look_back() {
    auto journal = Journal::open("disk.db", disk_.vfs());
    if (!journal) return wrong("the journal does not open: " + journal.error().line());
    for (const std::string& line : bridge::audit(**journal)) wrong(line);
    for (const std::string& id : accepted_) {
      const auto held = (*journal)->task(id);
      if (!held || !*held) wrong(fmt::format("{} was accepted and is lost", id));
    }
    for (const auto& [id, outcome] : outcomes_) {
      const auto held = (*journal)->task(id);
      const bool same = held && *held && (*held)->record.outcome && (*held)->record.outcome->outcome == outcome;
      if (!same) wrong(fmt::format("{} ended as {} and did not", id, task::name(outcome)));
    }
    for (const auto& [id, step] : begun_) {
      const auto held = (*journal)->task(id);
      bool known = false;
      if (held && *held) {
        for (const bridge::Event& event : (*held)->events)
          known = known || (event.kind == bridge::kAttemptEvent && event.detail.value("step", kSteps) == step);
      }
      if (!known) wrong(fmt::format("step {} of {} was begun and the journal knows nothing of it", step, id));
    }
    for (const auto& [what, times] : world_.done) {
      if (times > 1) wrong(fmt::format("step {} of {} was done {} times", what.second, what.first, times));
    }
  }

  void all_is_done() {
    for (int number = 0; number < kTasks; ++number) {
      for (std::size_t step = 0; step < kSteps; ++step) {
        const int times = world_.done[{id_of(number), step}];
        const bool wanted = number + 1 < kTasks;  // the last one is cancelled, or was done before that
        if (times > 1 || (wanted && times != 1))
          wrong(fmt::format("step {} of {}: {} times", step, id_of(number), times));
      }
    }
  }

  Disk disk_;
  Random random_;
  World world_;
  world::World world_file_;
  task::SkillRegistry skills_;
  Time now_;
  std::set<std::string> accepted_;                       // told the sender
  std::map<std::string, Outcome> outcomes_;              // likewise
  std::set<std::pair<std::string, std::size_t>> begun_;  // skills that were started
  std::vector<std::string> wrong_;
};

std::int64_t operations_of_a_quiet_run() {
  Ordeal quiet(1, Disk::Syncs::kTruly);
  EXPECT_EQ(quiet.run(kNever), std::vector<std::string>{});
  return quiet.operations();
}

TEST(Crash, WhateverWasToldIsSoAndNothingIsDoneTwice) {
  const std::int64_t last = operations_of_a_quiet_run();
  EXPECT_GT(last, 100);
  for (std::int64_t n = 1; n <= last; ++n) {
    const auto wrong = Ordeal(static_cast<std::uint64_t>(n), Disk::Syncs::kTruly).run(n);
    ASSERT_EQ(wrong, std::vector<std::string>{}) << "the power goes first with operation " << n;
  }
}

// The proof is one only if it finds a disk out that does not do what it says.
TEST(Crash, ADiskThatNeverSyncsIsFoundOut) {
  const std::int64_t last = operations_of_a_quiet_run();
  int found = 0;
  for (std::int64_t n = 1; n <= last; n += 5)
    found += Ordeal(static_cast<std::uint64_t>(n), Disk::Syncs::kNever).run(n).empty() ? 0 : 1;
  EXPECT_GT(found, last / 5 / 2);
}

}  // namespace
}  // namespace pons::tests
