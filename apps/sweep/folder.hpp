// A sweep's folder: what may become one, who works there, and the report in it.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "apps/sweep/plan.hpp"
#include "pons/core/error.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {

// Held while a sweep works in its folder: a second one is refused. Gone with the process, however it ends.
class SweepLock {
 public:
  // Error: somebody else works there, or the folder cannot be written.
  [[nodiscard]] static Expected<SweepLock> take(const std::filesystem::path& sweep);
  SweepLock(SweepLock&& other) noexcept;
  SweepLock& operator=(SweepLock&&) = delete;
  ~SweepLock();

 private:
  explicit SweepLock(int file) : file_(file) {}
  int file_;
};

// Waits until nobody makes the run of that folder any more, and then keeps it for this process and those that it
// starts: whoever gets it next finds none of them at work. Its log is what is locked. Error: that cannot be opened, or
// `interrupted` said so while it waited.
[[nodiscard]] Expected<void> keep_run(const std::filesystem::path& folder, const std::function<bool()>& interrupted);

// The folder with this plan in it: an empty or new one gets it, one that has it goes on. Errors, and nothing is written
// then: it holds another plan, or what is no sweep's; it cannot be written.
[[nodiscard]] Expected<void> prepare(const std::filesystem::path& sweep, const SweepPlan& plan);

inline constexpr const char* kPageFile = "report.html";

// SWEEP/report.json and report.html, each whole or not at all.
[[nodiscard]] Expected<void> write_reports(const std::filesystem::path& sweep, const record::Sweep& report);

// The runs that are there, as they were made: all by one build and, of each world and plan of faults, of the same
// files. The build in `program`; empty where no run has ended. Error: they are not.
[[nodiscard]] Expected<std::vector<record::SweepRun>> collect(const std::filesystem::path& sweep, const SweepPlan& plan,
                                                              std::string& program);

}  // namespace pons::apps
