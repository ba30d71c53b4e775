#include "apps/sweep/conduct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <deque>
#include <optional>
#include <system_error>

#include "apps/run_kit.hpp"
#include "apps/sweep/children.hpp"
#include "apps/sweep/launch.hpp"
#include "apps/sweep/outcome.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using record::Fate;

constexpr double kLook_s = 0.2;
// A launcher's success, and what it made elsewhere, need not show here at the same moment: network file systems
// remember for up to a minute what was not there.
constexpr std::chrono::seconds kShowsUp{60};
constexpr std::chrono::seconds kLeaves{10};  // after the first Ctrl-C

struct Job {
  std::size_t run = 0;
  int slot = 0;
  Child child;
  std::optional<Clock::time_point> ended_at = std::nullopt;
};

class Conductor {
 public:
  Conductor(const Conducting& what, const Bases& bases, std::vector<record::SweepRun>& runs)
      : what_(what),
        bases_(bases),
        planned_(runs_of(*what.plan)),
        runs_(runs),
        progress_(stderr, what.talk, runs.size(), made(runs), what.jobs) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      if (!has_result(runs[i])) to_make_.push_back(i);
    }
    for (int slot = static_cast<int>(what.jobs); slot > 0; --slot) free_slots_.push_back(slot);
  }

  Expected<void> go() {
    ChildEvents events;
    Expected<void> good;
    while (true) {
      while (good && !interrupted() && !to_make_.empty() && jobs_.size() < what_.jobs) good = begin(to_make_.front());
      if (jobs_.empty()) break;
      progress_.going_on(jobs_.size());
      events.wait(kLook_s);
      take_in();
      if (interrupted() || !good) leave();
    }
    progress_.finish();
    return good;
  }

 private:
  static std::size_t made(const std::vector<record::SweepRun>& runs) {
    return static_cast<std::size_t>(std::ranges::count_if(runs, has_result));
  }

  Expected<void> begin(std::size_t run) {
    const std::string& name = planned_[run].name;
    const fs::path folder = what_.sweep / name;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) return fail(error.message(), folder.string(), "see that the sweep's folder can be written");
    fs::remove(folder / kLaunchFile, error);
    auto words = command_of(what_.sweep, name);
    if (!words) return std::unexpected(words.error());
    const int slot = free_slots_.back();
    if (!what_.launch.empty())
      words = std::vector<std::string>{"/bin/sh", "-c", filled(what_.launch, {*words, run + 1, slot})};
    auto child = Child::start({.words = *words, .output = folder / kLaunchFile, .group = Child::Group::kOwn});
    if (!child) return std::unexpected(child.error());
    free_slots_.pop_back();
    to_make_.pop_front();
    jobs_.push_back({run, slot, *child});
    return {};
  }

  void take_in() {
    std::erase_if(jobs_, [this](Job& job) {
      const auto ended = job.child.look();
      if (!ended) return false;
      if (!job.ended_at) job.ended_at = Clock::now();
      const PlannedRun& planned = planned_[job.run];
      const fs::path folder = what_.sweep / planned.name;
      record::SweepRun run = look_at(what_.sweep, *what_.plan, planned, bases_.of(planned));
      const bool may_show_up = run.fate == Fate::kMissing && !what_.launch.empty() && ended->signal == 0 &&
                               ended->code == 0 && !interrupted() && Clock::now() - *job.ended_at < kShowsUp;
      if (may_show_up) return false;
      free_slots_.push_back(job.slot);
      settle(std::move(run), *ended, folder, job.run);
      return true;
    });
  }

  void settle(record::SweepRun run, const Ended& ended, const fs::path& folder, std::size_t index) {
    if (run.fate == Fate::kMissing && !interrupted()) {
      run.fate = Fate::kFailed;
      run.why = fmt::format("{} {}; it {}", what_.launch.empty() ? "it" : "its launcher", describe(ended), run.why);
    }
    std::error_code error;
    if (fs::file_size(folder / kLaunchFile, error) == 0) fs::remove(folder / kLaunchFile, error);
    runs_[index] = std::move(run);
    if (!interrupted()) progress_.ended(runs_[index]);
  }

  void break_off(int number) {
    for (const Job& job : jobs_) job.child.signal(number);
  }

  // The first Ctrl-C asks, the second or ten seconds end.
  void leave() {
    if (!asked_at_) {
      asked_at_ = Clock::now();
      progress_.put(fmt::format("pons: {} runs are broken off\n", jobs_.size()));
      break_off(SIGTERM);
    } else if (interruptions() > 1 || Clock::now() - *asked_at_ > kLeaves) {
      break_off(SIGKILL);
    }
  }

  const Conducting& what_;
  const Bases& bases_;
  const std::vector<PlannedRun> planned_;
  std::vector<record::SweepRun>& runs_;
  SweepProgress progress_;
  std::deque<std::size_t> to_make_;
  std::vector<int> free_slots_;
  std::vector<Job> jobs_;
  std::optional<Clock::time_point> asked_at_;
};

}  // namespace

Expected<Bases> Bases::of(const SweepPlan& plan) {
  Bases bases;
  auto program = program_digest();
  if (!program) return std::unexpected(program.error());
  bases.program_ = std::move(*program);
  for (const std::string& world : plan.worlds) {
    for (const SweepFaults& faults : plan.faults) {
      auto files = files_digest(plan, world, faults);
      if (!files) return std::unexpected(files.error());
      bases.files_[{world, faults.name}] = std::move(*files);
    }
  }
  return bases;
}

Basis Bases::of(const PlannedRun& run) const { return {program_, files_.at({run.world, run.faults.name})}; }

std::vector<record::SweepRun> look_at_all(const fs::path& sweep, const SweepPlan& plan, const Bases& bases) {
  std::vector<record::SweepRun> runs;
  for (const PlannedRun& run : runs_of(plan)) runs.push_back(look_at(sweep, plan, run, bases.of(run)));
  return runs;
}

Expected<std::vector<std::string>> command_of(const fs::path& sweep, const std::string& run) {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return fail(error.message(), "/proc/self/exe", "see that /proc is mounted");
  return std::vector<std::string>{program.string(), "sweep", "--out", sweep.string(), "--one", run};
}

Expected<void> conduct(const Conducting& what, const Bases& bases, std::vector<record::SweepRun>& runs) {
  return Conductor(what, bases, runs).go();
}

}  // namespace pons::apps
