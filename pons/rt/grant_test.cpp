#include "pons/rt/grant.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>

#include <thread>

namespace pons::rt {
namespace {

TEST(MakeRealtime, SaysWhatWasRefusedAndWhatWouldHelp) {
  const Grant grant = make_realtime({.priority = 200, .cpu = CPU_SETSIZE - 1});
  munlockall();
  EXPECT_FALSE(grant.fifo);
  EXPECT_FALSE(grant.pinned);
  EXPECT_TRUE(grant.degraded());
  EXPECT_NE(grant.refused.find("SCHED_FIFO refused (Invalid argument): "), std::string::npos) << grant.refused;
  EXPECT_NE(grant.refused.find("; pinning refused (Invalid argument): name a CPU"), std::string::npos);
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

}  // namespace
}  // namespace pons::rt
