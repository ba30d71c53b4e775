// A journal that a disk has spoilt: a good one, with bytes changed and ends cut off. It opens or is refused in one
// readable line; whatever it then says, nothing crashes, and what it still takes it holds.
//
// The input is a list of edits, 6 bytes each: which of the two files and what to do, a place (3 bytes), a value (2).

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include "pons/bridge/journal/story.hpp"
#include "tests/crash/disk.hpp"

namespace {

using namespace pons;
using bridge::Journal;
using tests::Disk;

constexpr const char* kFile = "j.db";
constexpr const char* kLog = "j.db-wal";

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_journal: %s\n", what.c_str());
  std::abort();
}

task::Task sample(const std::string& id) { return {.id = id, .steps = {{"pick", {{"object", id}}}, {"place"}}}; }

// Database and log as they lie on the disk while a bridge is at work, one half of it in each.
const std::pair<std::string, std::string>& good() {
  static const std::pair<std::string, std::string> files = [] {
    Disk disk(1, Disk::Syncs::kTruly);
    const auto fill = [](Journal& journal, int from) {
      for (int i = from; i < from + 8; ++i) {
        const std::string id = std::string("t").append(std::to_string(i));
        (void)journal.accept(sample(id), Time{});
        (void)journal.event(id, Time{}, bridge::kStartedEvent);
        (void)journal.event(id, Time{}, bridge::kAttemptEvent, {{"step", 0}});
        if (i % 2 == 0) (void)journal.outcome(id, task::Outcome::kFailed, "no", Time{});
        (void)journal.commit();
      }
    };
    fill(**Journal::open(kFile, disk.vfs()), 0);
    const auto open = Journal::open(kFile, disk.vfs());
    fill(**open, 8);
    return std::pair(disk.content(kFile), disk.content(kLog));
  }();
  return files;
}

void edit(std::string& content, std::uint8_t how, std::size_t place, std::uint16_t value) {
  if (content.empty()) return;
  const std::size_t at = place % content.size();
  if (how == 0) {
    content.resize(at);
  } else {
    content[at] = static_cast<char>(value & 0xff);
    if (how == 1 && at + 1 < content.size()) content[at + 1] = static_cast<char>(value >> 8);
  }
}

void expect_readable(const Error& error) {
  if (error.line().empty() || error.line().find('\n') != std::string::npos) found("an error: " + error.line());
}

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  auto [database, log] = good();
  for (; size >= 6; data += 6, size -= 6) {
    const std::size_t place =
        data[1] | (static_cast<std::size_t>(data[2]) << 8) | (static_cast<std::size_t>(data[3]) << 16);
    const auto value = static_cast<std::uint16_t>(data[4] | (data[5] << 8));
    edit((data[0] & 1) != 0 ? log : database, (data[0] >> 1) & 7, place, value);
  }
  Disk disk(1, Disk::Syncs::kTruly);
  disk.put(kFile, std::move(database));
  disk.put(kLog, std::move(log));
  const auto journal = Journal::open(kFile, disk.vfs());
  if (!journal) {
    expect_readable(journal.error());
    return 0;
  }
  (void)bridge::audit(**journal);
  if (const auto tasks = (*journal)->tasks(); !tasks) expect_readable(tasks.error());
  if (const auto story = (*journal)->history("t3"); !story) expect_readable(story.error());
  if (const auto counts = (*journal)->counts(); !counts) expect_readable(counts.error());
  const auto taken = (*journal)->accept(sample("new"), Time{});
  if (!taken || !(*journal)->commit()) return 0;
  if (const auto held = (*journal)->holds(sample("new")); held && !*held) found("it took a task and does not hold it");
  return 0;
}
