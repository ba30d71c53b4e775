// The only truth about tasks: one SQLite file, in WAL mode with synchronous=FULL. What accept(), outcome() and commit()
// have returned from survives a killed process and a lost power supply; events may wait for the next of these.
//
// Times are run time, which begins at zero in every run; (run, time) orders what a file holds over several runs.
// One thread. One process at a time may own a file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/task.hpp"

namespace pons::bridge {

using task::Json;

enum class Accepted : std::uint8_t {
  kNew,
  kAlready,  // the same task under the same id is in the journal; nothing was written
};

struct OutcomeRecord {
  task::Outcome outcome = task::Outcome::kFailed;
  std::string reason;  // empty when it succeeded as asked
  Json detail = Json::object();
  std::int64_t run = 0;
  Time stamp;
};

struct TaskRecord {
  task::Task task;
  std::int64_t run = 0;  // of its acceptance
  Time accepted;
  bool started = false;  // has an event of kind kStartedEvent
  std::optional<OutcomeRecord> outcome;
};

struct Event {
  std::int64_t sequence = 0;  // grows with every event of the file
  std::string task;           // empty: of no task
  std::int64_t run = 0;
  Time stamp;
  std::string kind;
  Json detail = Json::object();
};

struct TaskHistory {
  TaskRecord record;
  std::vector<Event> events;  // as written
};

struct Counts {
  std::int64_t accepted = 0, open = 0, succeeded = 0, failed = 0, cancelled = 0, exception = 0, events = 0;
};

inline constexpr std::string_view kStartedEvent = "started";  // the task has left the queue: it may have moved things

class Journal {
 public:
  static constexpr int kVersion = 1;
  static constexpr std::int32_t kApplicationId = 0x506f6e73;  // "Pons"

  // Opens `file` or creates it, and begins a new run. ":memory:" keeps everything in memory, for runs that need no
  // file. Errors: missing directory, not writable, not a database, another program's database, another version, in use
  // by another process. A refused file is left as it was.
  [[nodiscard]] static Expected<std::unique_ptr<Journal>> open(const std::filesystem::path& file);
  // For looking only: the file must exist and nobody may own it now. What writes then fails.
  [[nodiscard]] static Expected<std::unique_ptr<Journal>> open_to_read(const std::filesystem::path& file);
  ~Journal();

  // Durable when it returns. Error: another task has this id, or the file cannot be written.
  [[nodiscard]] Expected<Accepted> accept(const task::Task& task, Time now);
  // Whether accept() would say kAlready. Error: another task has this id, or the file cannot be read.
  [[nodiscard]] Expected<bool> holds(const task::Task& task) const;
  // One thing that happened, to the task of that id or (empty id) to none. Durable after the next commit().
  [[nodiscard]] Expected<void> event(std::string_view id, Time now, std::string_view kind,
                                     const Json& detail = Json::object());
  // The task's one outcome. Durable when it returns. Error: no such task, it has an outcome, or the file cannot be
  // written.
  [[nodiscard]] Expected<void> outcome(std::string_view id, task::Outcome outcome, std::string_view reason, Time now,
                                       const Json& detail = Json::object());
  // Makes every event so far durable; costs nothing when there is none.
  [[nodiscard]] Expected<void> commit();

  // In the order of acceptance.
  [[nodiscard]] Expected<std::vector<TaskRecord>> tasks() const;
  // Nothing when there is no such task.
  [[nodiscard]] Expected<std::optional<TaskHistory>> task(std::string_view id) const;
  // Those of no task when `id` is empty.
  [[nodiscard]] Expected<std::vector<Event>> events(std::string_view id) const;
  [[nodiscard]] Expected<Counts> counts() const;
  // Of this opening; the first is 1.
  [[nodiscard]] std::int64_t run() const;

 private:
  struct Impl;
  explicit Journal(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::bridge
