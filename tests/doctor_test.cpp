// What pons doctor makes of what it reads and measures.

#include "apps/doctor.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "pons/rt/grant.hpp"
#include "tests/end_to_end/run_pons.hpp"

namespace pons::apps {
namespace {

using testing::HasSubstr;

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
      const int taken = rt::loop_cpu(sys_.path()) >= 0 ? rt::loop_cpu(sys_.path()) : here;
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

// A computer as packaging/ makes it.
class Settings : public testing::Test {
 protected:
  Settings() {
    write("sys/kernel/realtime", "1");
    write("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
    for (const int cpu : allowed_cpus()) write(governor(cpu), "performance");
    write("sys/devices/system/cpu/isolated", fmt::format("{}", fmt::join(allowed_cpus(), ",")));
    write("sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never");
    write("proc/swaps", "Filename Type Size Used Priority\n/swap file 1 0 -2");
    write("proc/sys/vm/swappiness", "10");
    write("proc/sys/kernel/sched_rt_runtime_us", "-1");
  }
  static std::string governor(int cpu) {
    return "sys/devices/system/cpu/cpu" + std::to_string(cpu) + "/cpufreq/scaling_governor";
  }
  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((root_ / file).parent_path());
    tests::write_text(root_ / file, text + "\n");
  }
  // With one of them otherwise.
  Finding with(const std::string& file, const std::string& text) const {
    const std::string before = tests::read_text(root_ / file);
    write(file, text);
    const Finding found = read_settings(root_.path());
    tests::write_text(root_ / file, before);
    return found;
  }

  const tests::Folder root_;
};

TEST_F(Settings, AreGoodAsThePackageSetsThem) { EXPECT_EQ(read_settings(root_.path()), Finding::kGood); }

TEST_F(Settings, AreEachMissed) {
  EXPECT_EQ(with("sys/kernel/realtime", ""), Finding::kDegraded);
  EXPECT_EQ(with("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet"), Finding::kDegraded);
  const int cpu = rt::loop_cpu(root_ / "sys") >= 0 ? rt::loop_cpu(root_ / "sys") : allowed_cpus().front();
  EXPECT_EQ(with(governor(cpu), "powersave"), Finding::kDegraded);
  EXPECT_EQ(with("sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never"), Finding::kDegraded);
  EXPECT_EQ(with("proc/sys/vm/swappiness", "60"), Finding::kDegraded);
  EXPECT_EQ(with("proc/sys/kernel/sched_rt_runtime_us", "500000"), Finding::kDegraded);
  EXPECT_EQ(with("sys/devices/system/cpu/isolated", ""), Finding::kDegraded);
  EXPECT_EQ(read_settings(root_.path()), Finding::kGood);
}

TEST_F(Settings, WithoutSwapSwappinessIsOfNoMatter) {
  write("proc/swaps", "Filename Type Size Used Priority");
  EXPECT_EQ(with("proc/sys/vm/swappiness", "60"), Finding::kGood);
}

// A container may be shown an empty file, or none.
TEST_F(Settings, ThatTheKernelHidesAreSaidToBeUnknown) {
  for (const auto& [file, what] :
       {std::pair{"proc/sys/kernel/sched_rt_runtime_us", "real-time budget"},
        {"proc/sys/vm/swappiness", "swappiness"},
        {"sys/devices/system/clocksource/clocksource0/current_clocksource", "clock source"}}) {
    const std::string before = tests::read_text(root_ / file);
    std::filesystem::remove(root_ / file);
    testing::internal::CaptureStdout();
    EXPECT_EQ(read_settings(root_.path()), Finding::kDegraded);
    EXPECT_THAT(testing::internal::GetCapturedStdout(),
                HasSubstr(fmt::format("slow  {:<26} unknown: the kernel does not tell\n", what)));
    tests::write_text(root_ / file, before);
  }
}

TEST(OneKilohertz, IsHeldWhereNoTickIsMissedOrLate) {
  using std::chrono::microseconds;
  rt::Jitter jitter{.ticks = 1000};
  for (int i = 0; i < 1000; ++i) jitter.lateness.record(microseconds(99));
  const auto said = [&](Finding finding) {
    testing::internal::CaptureStdout();
    EXPECT_EQ(judge_jitter(jitter), finding);
    return testing::internal::GetCapturedStdout();
  };
  // A verdict is worth as much as it was long.
  EXPECT_THAT(said(Finding::kGood), HasSubstr("held for 1.0 s: each of 1000 ticks within 100 µs\n"));
  jitter.missed = 1;
  EXPECT_THAT(said(Finding::kDegraded),
              HasSubstr("not held for 1.0 s: 1 of 1001 ticks (0.1 %) more than 100 µs late, 1 of them missed\n"));
  jitter.missed = 0;
  jitter.lateness.record(microseconds(110));
  EXPECT_EQ(judge_jitter(jitter), Finding::kDegraded);
}

}  // namespace
}  // namespace pons::apps
