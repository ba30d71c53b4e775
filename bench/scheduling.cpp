// What a waiting task costs: added to an arbiter with n others before it, granted and released; against a mutex and a
// std::priority_queue, turn by turn, with a second thread that asks either for its length all the time. Once at one
// moment, and once with a thousand tasks a second, where all who wait grow older meanwhile and are ranked anew. And how
// long it takes from a task's submission to the first tick of its skill.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "pons/bridge/bridge.hpp"
#include "pons/core/random.hpp"

namespace {

using namespace pons;
using Clock = std::chrono::steady_clock;

constexpr double kDispatchBar_us = 50;
constexpr Duration kBusy = std::chrono::milliseconds(1);  // between tasks, a thousand a second

double us_since(Clock::time_point begun) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begun).count();
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

struct Wanted {
  std::string id;
  int priority;
  Time deadline, accepted;
};

Wanted wanted(std::uint64_t number, Duration apart, Random& random) {
  const Time accepted{static_cast<std::int64_t>(number) * apart};
  return {fmt::format("P{:07}", number), static_cast<int>(random.below(101)),
          accepted + from_s(1000 * random.uniform()), accepted};
}

// What the bridge has.
class Ours {
 public:
  void add(const Wanted& task) {
    const std::lock_guard lock(mutex_);
    arbiter_.add({task.id, task.priority, task.deadline, task.accepted, {"arm"}});
  }
  void pass_one(Time now) {
    const std::lock_guard lock(mutex_);
    for (const std::string& id : arbiter_.grant(now)) arbiter_.release(id);
  }
  std::size_t length() {
    const std::lock_guard lock(mutex_);
    return arbiter_.queue_length();
  }

 private:
  std::mutex mutex_;
  bridge::Arbiter arbiter_{{"arm"}, {}};
};

// What one would write first: no ageing, no removal, no expiry, one resource.
class Heap {
 public:
  void add(const Wanted& task) {
    const std::lock_guard lock(mutex_);
    queue_.emplace(task.priority, -task.deadline.ns(), -task.accepted.ns(), task.id);
  }
  void pass_one(Time) {
    const std::lock_guard lock(mutex_);
    queue_.pop();
  }
  std::size_t length() {
    const std::lock_guard lock(mutex_);
    return queue_.size();
  }

 private:
  std::mutex mutex_;
  std::priority_queue<std::tuple<int, std::int64_t, std::int64_t, std::string>> queue_;
};

// Of one task in and one out, µs, while so many wait.
template <typename Queue>
double cost_us(std::size_t waiting, int count, Duration apart, std::uint64_t seed) {
  Random random(seed);
  Queue queue;
  std::vector<Wanted> tasks;
  for (std::size_t i = 0; i < waiting + static_cast<std::size_t>(count); ++i) tasks.push_back(wanted(i, apart, random));
  for (std::size_t i = 0; i < waiting; ++i) queue.add(tasks[i]);
  std::atomic<bool> stop = false;
  std::atomic<std::size_t> seen = 0;
  std::thread asks([&] {
    while (!stop.load(std::memory_order_relaxed)) {
      seen = queue.length();
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
  });
  const auto begun = Clock::now();
  for (std::size_t i = waiting; i < tasks.size(); ++i) {
    queue.add(tasks[i]);
    queue.pass_one(tasks[i].accepted);
  }
  const double us = us_since(begun) / count;
  stop = true;
  asks.join();
  return us;
}

// A skill that has nothing to do; or holds what it needs for ever.
class Nothing final : public task::Skill {
 public:
  explicit Nothing(Clock::time_point* ticked) : ticked_(ticked) {}
  task::Progress tick(Time) override {
    if (ticked_ == nullptr) return {};
    *ticked_ = Clock::now();
    return {task::Status::kSucceeded};
  }
  void pause(Time, task::Pause) override {}
  void resume(Time) override {}
  void cancel(Time) override {}
  void halt(Time) override {}

 private:
  Clock::time_point* ticked_;
};

// From a submission to its skill's first tick, µs: the journal in memory, `waiting` others before a busy resource.
double dispatch_us(int count, int waiting) {
  Clock::time_point ticked;
  task::SkillRegistry skills;
  const auto add = [&](const char* name, std::vector<std::string> resources, Clock::time_point* tells) {
    skills.add({.name = name,
                .summary = "for measurements",
                .schema = {{"type", "object"}},
                .resources = std::move(resources),
                .timeout = from_s(1000),
                .start = [tells](const task::Json&, Time) { return std::make_unique<Nothing>(tells); }});
  };
  add("nothing", {"arm"}, &ticked);
  add("other", {"gone"}, nullptr);
  world::World world;
  world.resources = {{"arm"}, {"gone"}};
  auto journal = bridge::Journal::open(":memory:");
  if (!journal) return -1;
  bridge::Bridge bridge(**journal, skills, world);
  for (int i = 0; i <= waiting; ++i) {
    if (!bridge.submit(fmt::format(R"({{"id":"w{}","steps":[{{"skill":"other"}}]}})", i), {})) return -1;
    if (i == 0) bridge.tick({});  // the first has what the others wait for
  }
  std::vector<double> times;
  Time now;
  for (int i = 0; i < count; ++i) {
    const std::string text = fmt::format(R"({{"id":"t{}","steps":[{{"skill":"nothing"}}]}})", i);
    now += std::chrono::milliseconds(10);
    const auto begun = Clock::now();
    if (!bridge.submit(text, now)) return -1;
    bridge.tick(now);
    times.push_back(std::chrono::duration<double, std::micro>(ticked - begun).count());
  }
  return median(times);
}

struct Options {
  int count = 20'000, rounds = 5;
  bool gate = false;
  std::string csv;
};

int run(const Options& options) {
  std::ofstream csv;
  if (!options.csv.empty()) {
    csv.open(options.csv);
    if (!csv) {
      fmt::print(stderr, "scheduling: {}: cannot be written; name a file in a folder that exists\n", options.csv);
      return 2;
    }
    csv << "waiting,arbiter_us,ageing_us,heap_us\n";
  }
  for (std::size_t waiting = 10; waiting <= 100'000; waiting *= 10) {
    std::vector<double> ours, ageing, heap;
    for (int round = 0; round < options.rounds; ++round) {
      const auto seed = static_cast<std::uint64_t>(round) + 1;
      ours.push_back(cost_us<Ours>(waiting, options.count, Duration{0}, seed));
      heap.push_back(cost_us<Heap>(waiting, options.count, Duration{0}, seed));
      ageing.push_back(cost_us<Ours>(waiting, options.count, kBusy, seed));
    }
    fmt::print(
        "{:>7} waiting: {:5.2f} us a task in and out, {:5.2f} us at 1,000 a second; std::priority_queue {:5.2f}\n",
        waiting, median(ours), median(ageing), median(heap));
    if (csv.is_open())
      csv << fmt::format("{},{:.4f},{:.4f},{:.4f}\n", waiting, median(ours), median(ageing), median(heap));
  }
  std::vector<double> dispatch;
  for (int round = 0; round < options.rounds; ++round) dispatch.push_back(dispatch_us(2'000, 0));
  const double us = median(dispatch);
  fmt::print("submission to the skill's first tick: {:.1f} us, with 9,000 others waiting {:.1f} us\n", us,
             dispatch_us(500, 9'000));
  if (!options.gate || (us > 0 && us <= kDispatchBar_us)) return 0;
  fmt::print(stderr, "scheduling: a task takes longer than {:.0f} us to its skill\n", kDispatchBar_us);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("What a waiting task costs, and how soon one that need not wait begins");
    app.add_option("--count", options.count, "Tasks a measurement")->check(CLI::PositiveNumber);
    app.add_option("--rounds", options.rounds, "Rounds; figures are their medians")->check(CLI::PositiveNumber);
    app.add_option("--csv", options.csv, "For bench/scheduling.gp");
    app.add_flag("--gate", options.gate, "Exit code 1 when a task takes longer than 50 us to its skill");
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "scheduling: {}\n", error.what());
    return 2;
  }
}
