// A tree that goes round for long, whose history is shortened as it goes, on a disk that loses its power then: the next
// bridge goes on where it was, and nothing is done twice or left out.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <memory>
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

constexpr int kRounds = 200;  // of four events each
static_assert(4 * kRounds > bridge::kMostEvents + (bridge::kMostEvents - bridge::kLastEvents));
constexpr int kMostPowerOffs = 5;
constexpr std::int64_t kNever = 1'000'000;
constexpr Duration kPeriod = std::chrono::milliseconds(50);

// One of the rounds, done in its second tick, without a look at whether it was done already.
class Round final : public task::Skill {
 public:
  explicit Round(int& done) : done_(done) {}
  task::Progress tick(Time) override {
    if (!std::exchange(begun_, true)) return {};
    ++done_;
    return {task::Status::kSucceeded};
  }
  void pause(Time, task::Pause) override {}
  void resume(Time) override {}
  void cancel(Time) override {}
  void halt(Time) override {}

 private:
  int& done_;
  bool begun_ = false;
};

std::string tree_task() {
  const std::string xml = fmt::format(
      R"(<root BTCPP_format="4"><BehaviorTree><Sequence><Script code="n := 0"/><Repeat num_cycles="{}">
         <Sequence><Script code="n = n + 1"/><round number="{{n}}"/></Sequence></Repeat></Sequence></BehaviorTree></root>)",
      kRounds);
  return Json{{"id", "tree"}, {"tree", {{"xml", xml}}}}.dump();
}

class LongTree {
 public:
  explicit LongTree(std::uint64_t seed) : disk_(seed, Disk::Syncs::kTruly), random_(seed) {
    world_file_.resources = {{"arm"}};
    skills_.add({.name = "round",
                 .summary = "for tests",
                 .schema = Json::parse(R"({"type":"object","properties":{"number":{"type":"integer"}}})"),
                 .resources = {"arm"},
                 .timeout = std::chrono::seconds(10),
                 .start = [this](const Json& arguments, Time) {
                   return std::make_unique<Round>(done_[arguments.at("number").get<int>()]);
                 }});
  }

  // The power goes first with the n-th operation of the disk, then at random. Everything that was not as promised.
  std::vector<std::string> run(std::int64_t first_power_off) {
    disk_.power_off_at(first_power_off);
    quiet_ = first_power_off == kNever;
    for (int power_offs = 0; power_offs < kMostPowerOffs; ++power_offs) {
      if (live()) return wrong_;
      disk_.restart();
      disk_.power_off_at(static_cast<std::int64_t>(1 + random_.below(300)));
    }
    disk_.restart();
    if (!live()) wrong_.emplace_back("it does not end");
    return wrong_;
  }
  // The disk's operations before and after each tick in which the history was shortened.
  [[nodiscard]] const std::vector<std::pair<std::int64_t, std::int64_t>>& shortened() const { return shortened_; }

 private:
  void wrong(std::string what) { wrong_.push_back(std::move(what)); }

  // From switching on until the task has ended (true) or the power goes.
  bool live() {
    auto journal = Journal::open("disk.db", disk_.vfs());
    if (!journal) return gone("the journal does not open: " + journal.error().line());
    Bridge bridge(**journal, skills_, world_file_);
    const auto look = [this](const task::Task& task, std::size_t) -> bridge::Resumption {
      const auto& arguments = task.steps[0].arguments;
      return {.done = done_[arguments.at("number").get<int>()] > 0 ? 1u : 0u};
    };
    for (const std::string& line : bridge::audit(**journal)) wrong(line);
    if (auto recovered = bridge.recover(look, now_); !recovered) return gone(recovered.error().line());
    if (auto admitted = bridge.submit(tree_task(), now_); !admitted) return gone(admitted.error().line());
    for (int i = 0; i < 10 * kRounds && !bridge.idle(); ++i) {
      const std::int64_t before = disk_.operations();
      bridge.tick(now_ += kPeriod);
      if (bridge.fault()) return gone(bridge.fault()->line());
      if (quiet_) look_at(**journal, before);
    }
    if (!bridge.idle()) wrong("the task stays open");
    if (auto kept = bridge.commit(now_); !kept) return gone(kept.error().line());
    disk_.power_off_at(kNever);
    const auto task = (*journal)->task("tree");
    const auto outcome = task && *task ? (*task)->record.outcome : std::nullopt;
    if (!outcome || outcome->outcome != task::Outcome::kSucceeded)
      wrong("it has not succeeded: " + (outcome ? outcome->reason : std::string("no outcome")));
    for (const std::string& line : bridge::audit(**journal)) wrong(line);
    if (task && *task && (*task)->events.size() > bridge::kMostEvents + 8)
      wrong(fmt::format("{} events are held", (*task)->events.size()));
    for (int round = 1; round <= kRounds; ++round) {
      if (done_[round] != 1) wrong(fmt::format("round {} was done {} times", round, done_[round]));
    }
    return true;
  }

  bool gone(const std::string& why) {
    if (!disk_.off()) wrong("a fault without a cause: " + why);
    return !disk_.off();
  }

  void look_at(const Journal& journal, std::int64_t before) {
    const auto task = journal.task("tree");
    if (!task || !*task) return;
    const bool shorter = (*task)->events.size() < held_;
    held_ = (*task)->events.size();
    if (shorter) shortened_.emplace_back(before, disk_.operations());
  }

  Disk disk_;
  Random random_;
  std::map<int, int> done_;  // what is so, whatever a computer remembers: how often each round was done
  world::World world_file_;
  task::SkillRegistry skills_;
  Time now_;
  bool quiet_ = false;
  std::size_t held_ = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> shortened_;
  std::vector<std::string> wrong_;
};

TEST(Crash, AShortenedHistoryIsWholeWheneverThePowerGoes) {
  LongTree quiet(1);
  ASSERT_EQ(quiet.run(kNever), std::vector<std::string>{});
  ASSERT_GE(quiet.shortened().size(), 2u);
  for (const auto& [before, after] : quiet.shortened()) {
    ASSERT_GT(after, before);
    for (std::int64_t n = before - 5; n <= after + 5; ++n) {
      const auto wrong = LongTree(static_cast<std::uint64_t>(n)).run(n);
      ASSERT_EQ(wrong, std::vector<std::string>{}) << "the power goes first with operation " << n;
    }
  }
}

}  // namespace
}  // namespace pons::tests
