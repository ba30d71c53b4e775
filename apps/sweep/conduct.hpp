// Makes the runs of a sweep that are not there yet, so many at once.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "apps/sweep/plan.hpp"
#include "apps/sweep/telling.hpp"
#include "pons/core/error.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {

struct Conducting {
  std::filesystem::path sweep;  // absolute
  const SweepPlan* plan = nullptr;
  std::size_t jobs = 1;
  std::string launch;  // empty: each run is a process of this computer
  SweepProgress::Talk talk = SweepProgress::Talk::kUsual;
};

// What the runs of this plan are made on now. Error: that of files_digest.
class Bases {
 public:
  [[nodiscard]] static Expected<Bases> of(const SweepPlan& plan);
  [[nodiscard]] Basis of(const PlannedRun& run) const;
  [[nodiscard]] const std::string& program() const { return program_; }

 private:
  std::string program_;
  std::map<std::pair<std::string, std::string>, std::string> files_;  // by world and faults
};

[[nodiscard]] std::vector<record::SweepRun> look_at_all(const std::filesystem::path& sweep, const SweepPlan& plan,
                                                        const Bases& bases);

// What makes one run, here or anywhere that sees the sweep's folder under the same path.
[[nodiscard]] Expected<std::vector<std::string>> command_of(const std::filesystem::path& sweep, const std::string& run);

// Until all have a result or the third Ctrl-C; the first lets those that go on leave, the second ends them. Takes up
// `runs` as they were looked at, and leaves there what became of them. Error: a process cannot be started.
[[nodiscard]] Expected<void> conduct(const Conducting& what, const Bases& bases, std::vector<record::SweepRun>& runs);

}  // namespace pons::apps
