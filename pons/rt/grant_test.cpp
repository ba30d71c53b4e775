#include "pons/rt/grant.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pons/rt/test_rights.hpp"

namespace pons::rt {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr int kPriority = 37;

std::size_t locked_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::size_t kib = 0;
    if (word == "VmLck:" && status >> kib) return kib;
  }
  return 0;
}

// The calling thread's, by the kernel.
struct Scheduled {
  int policy = sched_getscheduler(0), priority = 0;
  Scheduled() {
    sched_param param{};
    sched_getparam(0, &param);
    priority = param.sched_priority;
  }
  bool operator==(const Scheduled&) const = default;
};

// What the kernel gives the calling thread, asked without make_realtime and given back.
struct Given {
  int fifo_error = 0, lock_error = 0;
  bool locks = false;  // the sanitizers' mlockall does nothing, and says it did
};
Given ask_kernel() {
  Given given;
  const sched_param wanted{.sched_priority = kPriority}, ordinary{.sched_priority = 0};
  if (sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) given.fifo_error = errno;
  sched_setscheduler(0, SCHED_OTHER, &ordinary);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) given.lock_error = errno;
  given.locks = locked_kib() > 0;
  munlockall();
  return given;
}

// make_realtime does as much as the kernel, asked by itself, and says so.
void expect_as_given() {
  const Given given = ask_kernel();
  const Scheduled before;
  const Grant grant = make_realtime({.priority = kPriority});
  EXPECT_EQ(grant.fifo, given.fifo_error == 0);
  EXPECT_EQ(grant.locked, given.lock_error == 0);
  const std::size_t present = locked_kib();
  EXPECT_EQ(present > 0, given.locks);
  constexpr std::size_t kLater_kib = 1024;
  void* const later = mmap(nullptr, kLater_kib * 1024, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  EXPECT_EQ(locked_kib() >= present + kLater_kib, given.locks) << "what comes later, too";
  munmap(later, kLater_kib * 1024);
  munlockall();
  const Scheduled now;
  EXPECT_EQ(now.policy, grant.fifo ? SCHED_FIFO : before.policy);
  EXPECT_EQ(now.priority, grant.fifo ? kPriority : before.priority);
  const auto expect_told = [&](const std::string& what, int error) {
    if (error == 0) {
      EXPECT_THAT(grant.refused, Not(Contains(StartsWith(what))));
    } else {
      EXPECT_THAT(grant.refused, Contains(StartsWith(what + " refused (" + std::strerror(error) + "): ")));
    }
  };
  expect_told("SCHED_FIFO", given.fifo_error);
  expect_told("locking memory", given.lock_error);
}

TEST(MakeRealtime, TakesWhatTheKernelGives) { std::thread(expect_as_given).join(); }

TEST(MakeRealtime, GoesOnWithoutWhatTheKernelRefuses) {
  std::thread([] {
    const WithoutRights without;
    EXPECT_EQ(ask_kernel().fifo_error, EPERM);
    expect_as_given();
  }).join();
}

// Root has them unless its surroundings keep them; anybody else can be helped on the spot.
TEST(MakeRealtime, SaysWhatWouldHelpWhoAsks) {
  constexpr uid_t kNobody = 65'534;
  const auto refused_fifo = [] {
    for (const std::string& line : make_realtime({.priority = kPriority}).refused) {
      if (line.starts_with("SCHED_FIFO")) return line;
    }
    return std::string();
  };
  std::thread([&] {
    const WithoutRights without;
    if (geteuid() == 0) {
      EXPECT_THAT(refused_fifo(), HasSubstr("container the capability cap_sys_nice"));
      // The system call is this thread's alone; the library's function would be the process's.
      ASSERT_EQ(syscall(SYS_setresuid, kNobody, kNobody, kNobody), 0);
    }
    EXPECT_THAT(refused_fifo(), HasSubstr("sudo setcap cap_sys_nice,cap_ipc_lock+ep /"));
    EXPECT_THAT(refused_fifo(), HasSubstr("/rt_test, or run it as a service, by a unit of packaging/systemd/"));
  }).join();
  munlockall();
}

// Runs it on a stack that nobody has touched. ThreadSanitizer keeps the better part of a MiB of its own on each
// thread's.
void on_a_fresh_stack(std::function<void()> run) {
  constexpr std::size_t kBytes = 8UL * 1024 * 1024;
  void* const stack = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(stack, MAP_FAILED);
  madvise(stack, kBytes, MADV_NOHUGEPAGE);  // one touch would bring in all of it
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack, kBytes);
  pthread_t thread{};
  const auto body = [](void* what) -> void* {
    (*static_cast<std::function<void()>*>(what))();
    return nullptr;
  };
  ASSERT_EQ(pthread_create(&thread, &attributes, body, &run), 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  munmap(stack, kBytes);
}

// Sanitizers would touch pages of their own for each of the stack's.
__attribute__((noinline, no_sanitize("address"), no_sanitize("thread"))) long faults_of_using(std::size_t bytes) {
  rusage before{}, after{};
  getrusage(RUSAGE_THREAD, &before);
  auto* const stack = static_cast<volatile char*>(__builtin_alloca(bytes));
  for (std::size_t i = 0; i < bytes; i += 1024) stack[bytes - 1 - i] = 1;
  getrusage(RUSAGE_THREAD, &after);
  return after.ru_minflt - before.ru_minflt + after.ru_majflt - before.ru_majflt;
}

// Without locked memory, which would bring the stack in whether it is touched or not.
TEST(MakeRealtime, TouchesTheStackBeforeItIsNeeded) {
  constexpr std::size_t kUsed = 200 * 1024;
  long untouched = 0, touched = 0;
  on_a_fresh_stack([&] {
    (void)faults_of_using(1024);  // the code's own pages
    untouched = faults_of_using(kUsed);
  });
  on_a_fresh_stack([&] {
    const WithoutRights without;
    (void)make_realtime({.priority = 0});
    touched = faults_of_using(kUsed);
  });
  EXPECT_GT(untouched, 10) << "this test sees no faults";
  EXPECT_EQ(touched, 0);
}

TEST(MakeRealtime, SaysWhatWasRefusedAndWhatWouldHelp) {
  const Grant grant = make_realtime({.priority = 200, .cpu = CPU_SETSIZE - 1});
  munlockall();
  EXPECT_FALSE(grant.fifo);
  EXPECT_FALSE(grant.pinned);
  EXPECT_TRUE(grant.degraded());
  EXPECT_THAT(grant.refused, Contains(StartsWith("SCHED_FIFO refused (Invalid argument): ")));
  EXPECT_THAT(grant.refused, Contains(StartsWith("pinning refused (Invalid argument): name a CPU")));
}

TEST(MakeRealtime, PinsTheThreadThatAsksAndNoOther) {
  const int cpu = sched_getcpu();
  cpu_set_t before;
  sched_getaffinity(0, sizeof before, &before);
  Grant grant;
  int ran_on = -1;
  std::thread([&] {
    grant = make_realtime({.priority = 0, .cpu = cpu});
    ran_on = sched_getcpu();
  }).join();
  munlockall();
  EXPECT_TRUE(grant.pinned);
  EXPECT_EQ(ran_on, cpu);
  cpu_set_t after;
  sched_getaffinity(0, sizeof after, &after);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

TEST(KeptOff, ThreadsThatAreStartedMeanwhileKeepOffThatCpu) {
  cpu_set_t before, started, after;
  sched_getaffinity(0, sizeof before, &before);
  const int cpu = loop_cpu();  // none where there is one CPU only
  {
    const KeptOff off(cpu);
    std::thread([&] { sched_getaffinity(0, sizeof started, &started); }).join();
  }
  cpu_set_t others = before;
  if (cpu >= 0) CPU_CLR(static_cast<std::size_t>(cpu), &others);
  EXPECT_TRUE(CPU_EQUAL(&started, &others));
  sched_getaffinity(0, sizeof after, &after);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
  const KeptOff nothing(-1);
  sched_getaffinity(0, sizeof after, &after);
  EXPECT_TRUE(CPU_EQUAL(&before, &after));
}

TEST(ShortTurns, ThreadsThatAreStartedMeanwhileHaveThem) {
  const std::uint64_t before = turn_ns();
  std::uint64_t within = 0, started = 0;
  {
    const ShortTurns turns;
    within = turn_ns();
    std::thread([&] { started = turn_ns(); }).join();
  }
  EXPECT_EQ(turn_ns(), before);
  EXPECT_EQ(within, started);
  EXPECT_TRUE(before == 0 ? started == 0 : started < before) << started << " after " << before;
}

TEST(LoopCpu, IsOneThatTheThreadMayUse) {
  std::thread([] {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(static_cast<std::size_t>(sched_getcpu()), &one);
    sched_setaffinity(0, sizeof one, &one);
    EXPECT_EQ(loop_cpu(), -1) << "pinning to the only CPU is of no use";
  }).join();
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  if (const int cpu = loop_cpu(); cpu >= 0) {
    EXPECT_TRUE(CPU_ISSET(static_cast<std::size_t>(cpu), &allowed));
  }
}

// With such a file of the kernel's.
class IsolatedCpus : public testing::Test {
 protected:
  IsolatedCpus() { std::filesystem::create_directories(folder_); }
  ~IsolatedCpus() override { std::filesystem::remove_all(sys_); }
  void write(const std::string& list) const { std::ofstream(folder_ / "isolated") << list << "\n"; }
  std::vector<int> isolated() const {
    std::vector<int> cpus;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (is_isolated(cpu, sys_)) cpus.push_back(cpu);
    }
    return cpus;
  }

  const std::filesystem::path sys_ =
      std::filesystem::path(testing::TempDir()) / ("isolated." + std::to_string(getpid()));
  const std::filesystem::path folder_ = sys_ / "devices/system/cpu";
};

TEST_F(IsolatedCpus, AreReadAsTheKernelListsThem) {
  EXPECT_THAT(isolated(), IsEmpty()) << "there is no such file";
  for (const auto& [list, cpus] : std::vector<std::pair<std::string, std::vector<int>>>{{"", {}},
                                                                                        {"3", {3}},
                                                                                        {"0-3,6", {0, 1, 2, 3, 6}},
                                                                                        {"1,4-5,1023", {1, 4, 5, 1023}},
                                                                                        {"1022-5000", {1022, 1023}},
                                                                                        {"none", {}}}) {
    write(list);
    EXPECT_EQ(isolated(), cpus) << list;
  }
  EXPECT_FALSE(is_isolated(-1, sys_));
}

TEST_F(IsolatedCpus, AreTakenBeforeOthersTheLastOfThemThatTheThreadMayUse) {
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::vector<int> mine, others;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
    (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed) ? mine : others).push_back(cpu);
  const auto chosen = [&](int cpu) { return mine.size() > 1 ? cpu : -1; };  // of one there is no choice
  EXPECT_EQ(loop_cpu(sys_), chosen(mine.back()));
  for (std::size_t i = 0; i < mine.size(); ++i) {
    write(std::to_string(mine[i]));
    EXPECT_EQ(loop_cpu(sys_), chosen(mine[i]));
    write(std::to_string(mine.front()) + "," + std::to_string(mine[i]));
    EXPECT_EQ(loop_cpu(sys_), chosen(mine[i]));
    write(std::to_string(mine[i]) + "," + std::to_string(others.back()));
    EXPECT_EQ(loop_cpu(sys_), chosen(mine[i])) << "the other one is not to be had";
  }
  write(std::to_string(others.back()));
  EXPECT_EQ(loop_cpu(sys_), chosen(mine.back()));
}

}  // namespace
}  // namespace pons::rt
