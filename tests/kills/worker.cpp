// A bridge with its journal and its socket and no robot: what tools/kill_processes kills by the thousand. Bridge, desk,
// socket and journal are the product's, on a real disk; a skill's work is a line in a file, the ground, which tells
// what was really begun and done, whatever any process remembers.
//
// usage: kill_worker JOURNAL SOCKET GROUND     ends with Ctrl-C only
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "apps/desk.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/rt/periodic_loop.hpp"
#include "pons/runner/health.hpp"

namespace pons::tests {
namespace {

using task::Json;

constexpr Duration kPeriod = std::chrono::milliseconds(1);  // ten times as dense as a real bridge's
constexpr int kTicks = 3;                                   // that a step takes
constexpr std::size_t kLine = 64;                           // bytes of a line on the ground: pages are multiples of it

volatile std::sig_atomic_t asked_to_end = 0;

class Ground {
 public:
  explicit Ground(std::string file)
      : file_(std::move(file)), opened_(::open(file_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600)) {}
  // One write within one page of the file, so that a kill leaves a whole line or none: the kernel ends a longer one
  // between two pages.
  void add(const char* what, const std::string& step) const {
    const std::string line = fmt::format("{:<{}}\n", fmt::format("{} {}", what, step), kLine - 1);
    if (line.size() != kLine) ::_exit(4);
    if (::write(opened_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) ::_exit(3);
  }
  [[nodiscard]] std::set<std::string> lines() const {
    std::set<std::string> found;
    std::ifstream in(file_);
    for (std::string line; std::getline(in, line);) found.insert(line.substr(0, line.find_last_not_of(' ') + 1));
    return found;
  }

 private:
  std::string file_;
  int opened_;
};

std::string step_of(const std::string& task, std::size_t step) { return fmt::format("{} {}", task, step); }

// It does not look whether it was done before: that it is not begun then is the bridge's part.
class Work final : public task::Skill {
 public:
  Work(const Ground& ground, std::string step) : ground_(ground), step_(std::move(step)) {
    ground_.add("begun", step_);
  }
  task::Progress tick(Time) override {
    if (++ticks_ < kTicks) return {};
    ground_.add("done", step_);
    return {task::Status::kSucceeded};
  }
  void pause(Time, task::Pause) override {}
  void resume(Time) override {}
  void cancel(Time) override {}
  void halt(Time) override {}

 private:
  const Ground& ground_;
  std::string step_;
  int ticks_ = 0;
};

int failed(const Error& error) {
  std::fputs((error.line() + "\n").c_str(), stderr);
  return 1;
}

int work(const std::string& place, const std::string& socket, const Ground& ground) {
  auto journal = bridge::Journal::open(place);
  if (!journal) return failed(journal.error());
  world::World world;
  world.resources = {{"arm"}};
  task::SkillRegistry skills;
  skills.add({.name = "work",
              .summary = "for tests",
              .schema = Json::parse(R"({"type":"object"})"),
              .resources = {"arm"},
              .timeout = std::chrono::seconds(10),
              .start = [&](const Json& arguments, Time) {
                return std::make_unique<Work>(
                    ground, step_of(arguments.at("task").get<std::string>(), arguments.at("step").get<std::size_t>()));
              }});
  bridge::Bridge bridge(**journal, skills, world);
  const auto look = [lines = ground.lines()](const task::Task& task, std::size_t done) -> bridge::Resumption {
    while (done < task.steps.size() && lines.contains("done " + step_of(task.id, done))) ++done;
    return {.done = done};
  };
  if (auto taken = bridge.recover(look, Time{}); !taken) return failed(taken.error());
  auto visitors = gate::LocalSocket::listen(socket);
  if (!visitors) return failed(visitors.error());
  const runner::Health health({});
  apps::Desk desk(std::move(*visitors), bridge, **journal, {}, health, [] { return nullptr; });
  const rt::MonotonicClock clock;
  rt::PeriodicLoop loop(clock, kPeriod);
  loop.run([&](Time now) {
    desk.attend(now);
    bridge.tick(now);
    (void)bridge.take_outcomes();
    return asked_to_end == 0 && !bridge.fault();
  });
  return bridge.fault() ? failed(*bridge.fault()) : 0;
}

}  // namespace
}  // namespace pons::tests

int main(int count, char** words) {
  if (count != 4) {
    std::fputs("usage: kill_worker JOURNAL SOCKET GROUND\n", stderr);
    return 2;
  }
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { pons::tests::asked_to_end = 1; });
  return pons::tests::work(words[1], words[2], pons::tests::Ground(words[3]));
}
