// What a real-time run does when its control loop is held up: with every real part, and a loop thread that a signal
// holds where it happens to be.

#include "pons/runner/realtime.hpp"

#include <dirent.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

#include "apps/assembly.hpp"

namespace pons::runner {
namespace {

// As words that a signal handler may wait on.
std::atomic<int> hold{0}, held{0};

// Runs on the loop's thread, in place of what it would do.
void stand_still(int) {
  held.store(1);
  held.notify_all();
  while (hold.load() != 0) hold.wait(1);
}

void let_go() {
  hold.store(0);
  hold.notify_all();
}

int loop_thread() {
  int found = 0;
  DIR* const tasks = opendir("/proc/self/task");
  while (const dirent* entry = readdir(tasks)) {
    std::string name;
    std::ifstream(std::string("/proc/self/task/") + entry->d_name + "/comm") >> name;
    if (name == "pons_loop") found = std::atoi(entry->d_name);
  }
  closedir(tasks);
  return found;
}

// The word that a thread sleeps on; 0 if it does something else.
std::uintptr_t sleeps_on(int thread) {
  long call = -1;
  std::uintptr_t word = 0;
  std::ifstream("/proc/self/task/" + std::to_string(thread) + "/syscall") >> call >> std::hex >> word;
  return call == SYS_futex ? word : 0;
}

class RealTimeLoop : public testing::Test {
 protected:
  void SetUp() override {
    auto world = world::load("worlds", "small_cell");
    ASSERT_TRUE(world) << world.error().line();
    const auto manifest = world::draw_manifest(*world, 1, 1);
    ASSERT_TRUE(manifest) << manifest.error().line();
    auto built = apps::Assembly::build(std::move(*world), *manifest, {.journal = ":memory:", .pace = Pace::kRealTime});
    ASSERT_TRUE(built) << built.error().line();
    cell_ = std::move(*built);
    parts_ = cell_->parts();
  }

  std::unique_ptr<apps::Assembly> cell_;
  Parts parts_;
};

// An emergency stop must not wait for the next tick: the word that is raised is the one on which the loop sleeps.
TEST_F(RealTimeLoop, SleepsOnTheEmergencyWord) {
  const auto word = reinterpret_cast<std::uintptr_t>(&parts_.body.robots.front().link->emergency_word());
  std::atomic<std::uintptr_t> slept_on{0};
  parts_.body.plant.advance = [&](Time now) {
    if (const int thread = loop_thread(); slept_on != word && thread != 0) slept_on = sleeps_on(thread);
    cell_->body->simulation->advance_to(now);
  };
  int ticks = 0;
  ASSERT_TRUE(run_realtime(parts_, {.interrupted = [&] { return ++ticks > 200 || slept_on == word; }}));
  EXPECT_EQ(slept_on.load(), word);
}

class HeldLoop : public RealTimeLoop {
 protected:
  void SetUp() override {
    RealTimeLoop::SetUp();
    struct sigaction action{};
    action.sa_handler = stand_still;
    sigaction(SIGUSR1, &action, nullptr);
    hold.store(0);
    held.store(0);
  }
  // What was left behind must not touch the parts when they are gone.
  void TearDown() override {
    let_go();
    while (loop_thread() != 0) std::this_thread::yield();
  }

  // From the body's thread: does not return before the loop stands still.
  void seize_loop() {
    int thread = 0;
    for (thread = loop_thread(); thread == 0; thread = loop_thread()) std::this_thread::yield();
    // Until its next tick, rather than still setting out.
    while (sleeps_on(thread) == 0) std::this_thread::yield();
    hold.store(1);
    ASSERT_EQ(syscall(SYS_tgkill, getpid(), thread, SIGUSR1), 0);
    held.wait(0);
  }
};

TEST_F(HeldLoop, ALoopThatIsGoneForGoodEndsTheRunWithAnError) {
  int advanced = 0;
  parts_.body.plant.advance = [&](Time now) {
    if (++advanced == 300) seize_loop();
    cell_->body->simulation->advance_to(now);
  };
  const auto result = run_realtime(parts_, {});
  ASSERT_FALSE(result) << "the loop is still held, for ever as far as the run knows";
  EXPECT_NE(result.error().what.find("silent"), std::string::npos) << result.error().line();
  EXPECT_EQ(hold.load(), 1);
  EXPECT_LT(advanced, 300 + 1100);
}

}  // namespace
}  // namespace pons::runner
