// What pons doctor reads of the CPU that the control loop would have.

#include "apps/doctor.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "pons/rt/grant.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::apps {
namespace {

std::vector<int> allowed_cpus() {
  cpu_set_t allowed;
  sched_getaffinity(0, sizeof allowed, &allowed);
  std::vector<int> cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &allowed)) cpus.push_back(cpu);
  }
  return cpus;
}

// The calling thread's.
void allow(const std::vector<int>& cpus) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  for (const int cpu : cpus) CPU_SET(static_cast<std::size_t>(cpu), &allowed);
  ASSERT_EQ(sched_setaffinity(0, sizeof allowed, &allowed), 0);
}

class LoopGovernor : public testing::Test {
 protected:
  // Each CPU's governor is named after it.
  LoopGovernor() {
    for (const int cpu : cpus_) {
      const auto folder = sys_ / ("devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq");
      std::filesystem::create_directories(folder);
      std::ofstream(folder / "scaling_governor") << "governor of CPU " << cpu << "\n";
    }
  }

  const tests::Folder sys_;
  const std::vector<int> cpus_ = allowed_cpus();
};

TEST_F(LoopGovernor, IsThatOfTheCpuThatTheLoopTakesWhereverTheDoctorRuns) {
  for (const int here : cpus_) {
    std::thread([&] {
      allow({here});
      allow(cpus_);
      const Governor governor = loop_governor(sys_.path());
      const int taken = rt::loop_cpu() >= 0 ? rt::loop_cpu() : here;
      EXPECT_EQ(governor.cpu, taken);
      EXPECT_EQ(governor.name, "governor of CPU " + std::to_string(taken));
    }).join();
  }
}

// Nothing to pin to: the loop runs where its thread does.
TEST_F(LoopGovernor, IsThatOfTheOnlyCpuThatThereIs) {
  for (const int here : cpus_) {
    std::thread([&] {
      allow({here});
      const Governor governor = loop_governor(sys_.path());
      EXPECT_EQ(governor.cpu, here);
      EXPECT_EQ(governor.name, "governor of CPU " + std::to_string(here));
    }).join();
  }
}

TEST_F(LoopGovernor, IsNobodyWhereTheKernelNamesNone) {
  EXPECT_EQ(loop_governor(sys_ / "of another computer").name, "");
}

}  // namespace
}  // namespace pons::apps
