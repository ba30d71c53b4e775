#include "apps/sweep/folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <map>
#include <system_error>
#include <utility>

#include "apps/sweep/outcome.hpp"
#include "pons/record/file.hpp"
#include "pons/record/sweep_page.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kLockFile = ".lock";

}  // namespace

Expected<SweepLock> SweepLock::take(const fs::path& sweep) {
  const fs::path file = sweep / kLockFile;
  const int opened = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (opened < 0) return fail(std::strerror(errno), file.string(), "name a folder that can be written");
  SweepLock lock(opened);
  if (flock(opened, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return fail("another sweep works here", sweep.string(), "wait until it has ended, or end it");
  return lock;
}

SweepLock::SweepLock(SweepLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

SweepLock::~SweepLock() {
  if (file_ >= 0) close(file_);
}

// Never closed here, and inherited: the kernel lets go of it when the last of these processes ends.
Expected<void> keep_run(const fs::path& folder, const std::function<bool()>& interrupted) {
  const fs::path file = folder / kLogFile;
  const int opened = open(file.c_str(), O_RDWR | O_CREAT | O_APPEND, 0666);
  if (opened < 0) return fail(std::strerror(errno), file.string(), "see that its folder can be written");
  // A file system without locks has none to wait for.
  while (flock(opened, LOCK_EX) != 0 && errno == EINTR) {
    if (interrupted()) return fail("interrupted while another process makes this run", file.string());
  }
  return {};
}

Expected<void> prepare(const fs::path& sweep, const SweepPlan& plan) {
  std::error_code error;
  const bool there = fs::exists(fs::symlink_status(sweep, error));
  if (there && !fs::is_directory(sweep, error)) return fail("is no folder", sweep.string(), "name another with --out");
  if (there && fs::exists(sweep / kPlanFile, error)) {
    const auto before = read_plan(sweep);
    if (!before) return std::unexpected(before.error());
    const std::string otherwise = differences(plan, *before);
    if (otherwise.empty()) return {};
    return fail(fmt::format("holds another sweep: {}", otherwise), sweep.string(),
                fmt::format("name another folder with --out, or go on with: {}", record::shell_line(before->command)));
  }
  if (there && !fs::is_empty(sweep, error))
    return fail("holds other things than a sweep", sweep.string(), "name a new or empty folder with --out");
  fs::create_directories(sweep, error);
  if (error) return fail(error.message(), sweep.string(), "name a folder that can be written with --out");
  return record::write_whole(sweep / kPlanFile,
                             to_json(plan).dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

Expected<void> write_reports(const fs::path& sweep, const record::Sweep& report) {
  const auto page = record::page(report);
  if (!page) return std::unexpected(page.error());
  const std::string json = record::to_json(report).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  if (auto written = record::write_whole(sweep / kReportFile, json); !written) return written;
  return record::write_whole(sweep / kPageFile, *page);
}

Expected<std::vector<record::SweepRun>> collect(const fs::path& sweep, const SweepPlan& plan, std::string& program) {
  std::vector<record::SweepRun> runs;
  std::map<std::pair<std::string, std::string>, std::string> files;
  for (const PlannedRun& planned : runs_of(plan)) {
    const auto outcome = read_outcome(sweep / planned.name);
    if (outcome && *outcome) {
      const Basis& basis = (*outcome)->basis;
      std::string& known = files[{planned.world, planned.faults.name}];
      if (!program.empty() && program != basis.program)
        return fail(fmt::format("was made by build {}, others by build {}", basis.program, program),
                    (sweep / planned.name).string(), fmt::format("make it anew: {}", record::shell_line(plan.command)));
      if (!known.empty() && known != basis.files)
        return fail("was made of other files than others of its world and faults", (sweep / planned.name).string(),
                    fmt::format("make it anew: {}", record::shell_line(plan.command)));
      program = basis.program;
      known = basis.files;
    }
    runs.push_back(look_at(sweep, plan, planned, std::nullopt));
  }
  return runs;
}

}  // namespace pons::apps
