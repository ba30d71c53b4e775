// Bridges in processes of their own on one order book, with and without being killed.
#include <fcntl.h>
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/journal/book.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/bridge/journal/test_journal.hpp"
#include "pons/core/random.hpp"
#include "tests/postgres/server.hpp"

namespace pons::bridge {
namespace {

using tests::PostgresServer;

constexpr int kOrders = 150;
constexpr int kKills = 40;
constexpr std::uint64_t kSeed = 7;

// What is so, whatever a process remembers: a line "begun ID" or "done ID" for each time.
class Ground {
 public:
  explicit Ground(const fs::path& file) : file_(file) {}
  void add(const char* what, const std::string& id) const {
    const int opened = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
    const std::string line = fmt::format("{} {}\n", what, id);
    if (::write(opened, line.data(), line.size()) != static_cast<ssize_t>(line.size())) ::_exit(3);
    ::close(opened);
  }
  [[nodiscard]] std::map<std::string, int> times() const {
    std::map<std::string, int> found;
    std::ifstream in(file_);
    for (std::string line; std::getline(in, line);) ++found[line];
    return found;
  }

 private:
  fs::path file_;
};

// Done in its third tick, unless it was done before.
class Work final : public task::Skill {
 public:
  Work(const Ground& ground, std::string id) : ground_(ground), id_(std::move(id)) { ground_.add("begun", id_); }
  Progress tick(Time) override {
    if (++ticks_ < 3) return {};
    if (!ground_.times().contains("done " + id_)) ground_.add("done", id_);
    return {Status::kSucceeded};
  }
  void pause(Time, task::Pause) override {}
  void resume(Time) override {}
  void cancel(Time) override {}
  void halt(Time) override {}

 private:
  const Ground& ground_;
  std::string id_;
  int ticks_ = 0;
};

// A bridge in a process of its own, which says a byte each tick, and where a skill begins, so that it may be killed
// there.
class Process {
 public:
  explicit Process(const std::function<void(const std::function<void()>& ticked)>& work) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
      ::close(ends[0]);
      work([&] {
        if (::write(ends[1], ".", 1) != 1) ::_exit(2);
      });
      ::_exit(0);
    }
    ::close(ends[1]);
    ticks_ = ends[0];
  }
  // Kills it after so many ticks of now, if it has not ended by then.
  void kill_after(std::uint64_t ticks) {
    char byte = 0;
    for (std::uint64_t i = 0; i < ticks && ::read(ticks_, &byte, 1) == 1; ++i) {
    }
    ::kill(child_, SIGKILL);
    (void)wait();
  }
  // Its status as of waitpid().
  int wait() {
    std::array<char, 4096> bytes;
    while (::read(ticks_, bytes.data(), bytes.size()) > 0) {
    }
    int status = 0;
    ::waitpid(child_, &status, 0);
    ::close(ticks_);
    return status;
  }

 private:
  pid_t child_ = -1;
  int ticks_ = -1;
};

class BookKillTest : public testing::Test {
 protected:
  BookKillTest() {
    auto senders = OrderBook::open(server_.place(database_)).value();
    for (int i = 0; i < kOrders; ++i) {
      const std::string id = fmt::format("t{}", i);
      const task::Task task{.id = id, .priority = i % 7 * 10, .steps = {{"work", {{"object", id}}}}};
      EXPECT_EQ(senders->submit(task), Accepted::kNew);
    }
  }

  // The life of one bridge, until it finds nothing to do.
  [[nodiscard]] Process bridge(const std::string& name) const {
    return Process([this, name](const std::function<void()>& ticked) {
      auto journal = Journal::open(server_.place(database_, name));
      if (!journal) ::_exit(4);
      world::World world;
      world.resources = {{"arm"}};
      task::SkillRegistry skills;
      skills.add({.name = "work",
                  .summary = "for tests",
                  .schema = Json::parse(R"({"type":"object"})"),
                  .resources = {"arm"},
                  .timeout = std::chrono::seconds(10),
                  .start = [&](const Json& arguments, Time) {
                    auto skill = std::make_unique<Work>(ground_, arguments.at("object").get<std::string>());
                    ticked();
                    return skill;
                  }});
      Bridge bridge(**journal, skills, world);
      const auto look = [this](const task::Task& task, std::size_t done) {
        return Resumption{.done = ground_.times().contains("done " + task.id) ? 1 : done};
      };
      Time now;
      if (!bridge.recover(look, now)) ::_exit(5);
      const auto free = [this] {
        return server_.ask(database_, "SELECT count(*) FROM pons.book WHERE claimed_by IS NULL") != "0";
      };
      do {
        for (int i = 0; i < 20 || !bridge.idle(); ++i) {
          bridge.tick(now += std::chrono::milliseconds(10));
          if (bridge.fault()) ::_exit(6);
          ticked();
        }
      } while (free());
    });
  }

  // Each order has one outcome and one journal, and what was begun is what that journal says. How often a bridge went
  // on with what one before had begun.
  int expect_each_once(const std::vector<std::string>& names) const {
    std::map<std::string, std::unique_ptr<Journal>> journals;
    for (const std::string& name : names) {
      journals[name] = Journal::open_to_read(server_.place(database_, name)).value();
      EXPECT_EQ(audit(*journals[name]), std::vector<std::string>{});
    }
    const auto orders = OrderBook::open_to_read(server_.place(database_)).value()->orders(OrderBook::Which::kAll);
    EXPECT_EQ(orders.value().size(), static_cast<std::size_t>(kOrders));
    auto times = ground_.times();
    int resumed = 0;
    for (const OrderRecord& order : orders.value()) {
      EXPECT_EQ(order.outcome, task::Outcome::kSucceeded) << order.id << " " << order.reason;
      EXPECT_EQ(times["done " + order.id], 1) << order.id;
      int accepted = 0;
      for (const auto& [name, journal] : journals) {
        const auto task = journal->task(order.id).value();
        if (!task) continue;
        ++accepted;
        EXPECT_EQ(order.claimed_by, name);
        EXPECT_EQ(task->record.outcome.value().outcome, task::Outcome::kSucceeded);
        EXPECT_LE(times["begun " + order.id], std::ranges::count(task->events, kAttemptEvent, &Event::kind))
            << order.id << " was begun and the journal knew nothing of it";
        resumed += static_cast<int>(std::ranges::count(task->events, kResumedEvent, &Event::kind));
      }
      EXPECT_EQ(accepted, 1) << order.id;
    }
    return resumed;
  }

  PostgresServer& server_ = PostgresServer::instance();
  std::string database_ = server_.make_database();
  TemporaryFolder folder_;
  Ground ground_{folder_ / "ground"};
};

TEST_F(BookKillTest, TwoBridgesRunEachOrderOnce) {
  Process one = bridge("one"), two = bridge("two");
  EXPECT_EQ(one.wait(), 0);
  EXPECT_EQ(two.wait(), 0);
  EXPECT_EQ(expect_each_once({"one", "two"}), 0);
  for (const auto& [what, times] : ground_.times()) EXPECT_EQ(times, 1) << what;
}

TEST_F(BookKillTest, BridgesThatAreKilledAtAnyMomentLoseNothingAndDoNothingTwice) {
  Random random(kSeed);
  const std::array<std::string, 2> names{"one", "two"};
  std::array<Process, 2> alive{bridge(names[0]), bridge(names[1])};
  for (int kills = 0; kills < kKills; ++kills) {
    const std::size_t which = random.below(2);
    alive.at(which).kill_after(random.below(12));
    alive.at(which) = bridge(names.at(which));
  }
  for (Process& process : alive) EXPECT_EQ(process.wait(), 0);
  EXPECT_GT(expect_each_once({names[0], names[1]}), 0) << "nobody was killed in the middle of anything";
}

}  // namespace
}  // namespace pons::bridge
