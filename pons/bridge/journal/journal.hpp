// The only truth about tasks: what happened, event by event, in one SQLite file (WAL, synchronous=FULL), or in a schema
// of a PostgreSQL database (synchronous_commit=on) that holds several bridges' journals and their order book; "file"
// below means either. Nothing in it is ever changed; what a task's state is, its events say. A task's first event is
// its acceptance, its last its outcome, and the file's own indexes refuse a second of either.
//
// Writing makes an event part of the journal at once, and durable with the next commit(): it then survives a killed
// process and a lost power supply. Tell nobody before. One commit costs one wait for the disk, whatever it holds.
//
// Times are run time, which begins at zero in every run; (run, time) orders what a file holds over several runs.
// One thread. One process at a time may own a file.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/json_value.hpp"
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
  std::int64_t sequence = 0;  // of its acceptance
  task::Task task;
  std::int64_t run = 0;  // of its acceptance
  Time accepted;
  bool started = false;  // has an event of kind kStartedEvent
  std::optional<OutcomeRecord> outcome;
};

struct Event {
  std::int64_t sequence = 0;  // grows with every event of the file
  std::string task;           // empty: of no task
  std::string order;          // of an acceptance or a note: what it belongs to; a task that names none is its own
  std::int64_t run = 0;
  Time stamp;
  std::string kind;
  Json detail = Json::object();
};

struct TaskHistory {
  TaskRecord record;
  std::vector<Event> events;  // as written, acceptance and outcome apart
};

// What a sender has put into the order book: the text of a task.
struct Order {
  std::string id, body;
};

struct Counts {
  std::int64_t accepted = 0, open = 0, succeeded = 0, failed = 0, cancelled = 0, exception = 0, events = 0;
};

// Kinds that the journal itself writes, or reads. Others are whoever's that notes them.
inline constexpr std::string_view kAcceptedEvent = "accepted";  // detail: the task
inline constexpr std::string_view kStartedEvent = "started";    // the task has left the queue: it may have moved things
inline constexpr std::string_view kEndedEvent = "ended";        // detail: {"outcome", "reason", "detail"}
inline constexpr std::string_view kCompactedEvent = "compacted";   // {"events": how many were dropped}
inline constexpr std::string_view kLeftOutEvent = "left_out";      // of an open task; likewise, in all
inline constexpr std::string_view kSeenEvent = "seen";             // where an order's parcel was
inline constexpr std::string_view kCarriesEvent = "carries";       // {"robot", "load"}: its newest says what it holds
inline constexpr std::string_view kClockBackEvent = "clock_back";  // {"by_s"}: until it has caught up, time stands

class Journal {
 public:
  static constexpr int kVersion = 2;
  static constexpr std::int32_t kApplicationId = 0x506f6e73;  // "Pons"

  // Opens what lies at `place` (place.hpp), or creates it, and begins a new run. ":memory:" keeps everything in memory,
  // for runs that need no file. Errors: missing directory, not writable, not a database, another program's database,
  // another version, in use by another process; of PostgreSQL also: not reached, or so set up that no commit is
  // durable. What is refused is left as it was. `vfs` names the SQLite VFS that holds a file; none is the operating
  // system's.
  [[nodiscard]] static Expected<std::unique_ptr<Journal>> open(const std::string& place, const char* vfs = nullptr);
  // For looking only: it must exist and be of this version; a file nobody may own now, one in a database is read
  // beside its owner, as of the last commit. What writes then fails.
  [[nodiscard]] static Expected<std::unique_ptr<Journal>> open_to_read(const std::string& place);
  // Brings one of an older version to this one, wholly or, after an error, not at all.
  [[nodiscard]] static Expected<void> upgrade(const std::string& place);
  // Commits what is pending.
  ~Journal();
  // As if the process were killed now: what is pending is lost, and nothing is written any more.
  void abandon();

  // Error: another task has this id, or the file cannot be written.
  [[nodiscard]] Expected<Accepted> accept(const task::Task& task, Time now);
  // Whether accept() would say kAlready. Error: another task has this id, or the file cannot be read.
  [[nodiscard]] Expected<bool> holds(const task::Task& task) const;
  // One thing that happened to an open task. Error: there is no such open task, or the file cannot be written.
  [[nodiscard]] Expected<void> event(std::string_view id, Time now, std::string_view kind,
                                     const Json& detail = Json::object());
  // One thing that happened to no task; `order` is what it belongs to, if anything.
  [[nodiscard]] Expected<void> note(Time now, std::string_view kind, const Json& detail = Json::object(),
                                    std::string_view order = {});
  // The task's one outcome, and its last event. Errors: as of event().
  [[nodiscard]] Expected<void> outcome(std::string_view id, task::Outcome outcome, std::string_view reason, Time now,
                                       const Json& detail = Json::object());
  // Drops what happened to an open task before the event of that sequence, but for its start and the events in `but`,
  // and says how many that are in all, with the `so_far` of earlier times. Becomes durable with the next commit(),
  // together with all that was written before. Errors: as of event().
  [[nodiscard]] Expected<void> leave_out(std::string_view id, Time now, std::int64_t before,
                                         const std::set<std::int64_t>& but, std::int64_t so_far);
  // Makes everything so far durable; costs nothing when there is nothing. Error: this or an earlier write failed. Then
  // whatever was written since the last commit is not part of the journal, and nothing is written any more: open it
  // anew. (What a disk had taken of a commit that failed may come to light there: send the same again.)
  [[nodiscard]] Expected<void> commit();

  // Takes up to `most` orders out of the order book of the journal's database, as this bridge's: the most important and
  // then the oldest first, none that another bridge has or whose priority is less than `least`, and for good only with
  // the next commit(), so that it becomes durable together with their acceptance. Where anybody may come, the oldest
  // comes first once it counts more than all others, with one priority more for each `ageing` that it has waited by the
  // server's clock. None from a file. Error: as a write's.
  [[nodiscard]] Expected<std::vector<Order>> claim(std::size_t most, int least, Duration ageing);
  // The ids of those that this bridge, or one of its name before it, has claimed and that have not ended. None of a
  // file. Error: as of a read.
  [[nodiscard]] Expected<std::set<std::string>> claimed();
  // How an order that was claimed has ended; outcome() says it by itself. Nothing happens where it is no such order, or
  // has ended before. Error: as a write's.
  [[nodiscard]] Expected<void> close_order(std::string_view id, task::Outcome outcome, std::string_view reason);

  // In the order of acceptance, page by page: of a long day no more is in memory. `take` may read and write this
  // journal; the first error that it gives back ends it.
  [[nodiscard]] Expected<void> each_task(const std::function<Expected<void>(const TaskRecord&)>& take) const;
  // Likewise, all at once.
  [[nodiscard]] Expected<std::vector<TaskRecord>> tasks() const;
  // Likewise, those that have not ended.
  [[nodiscard]] Expected<std::vector<TaskRecord>> open_tasks() const;
  // At most so many that have ended, of those accepted before the event of that sequence; the last accepted first.
  [[nodiscard]] Expected<std::vector<TaskRecord>> ended_tasks(std::int64_t before, std::int64_t most) const;
  // Nothing when there is no such task.
  [[nodiscard]] Expected<std::optional<TaskRecord>> record(std::string_view id) const;
  [[nodiscard]] Expected<std::optional<TaskHistory>> task(std::string_view id) const;
  // Those of no task, in the order in which they were written; as each_task() and tasks().
  [[nodiscard]] Expected<void> each_note(const std::function<Expected<void>(const Event&)>& take) const;
  [[nodiscard]] Expected<std::vector<Event>> notes() const;
  // All of a task, acceptance and outcome among them, but for the details of that kind of event.
  [[nodiscard]] Expected<std::vector<Event>> outline(std::string_view id, std::string_view without) const;
  // All that belongs to an order, of whatever task or of none, written after that sequence; a task's own id will do as
  // well.
  [[nodiscard]] Expected<std::vector<Event>> history(std::string_view order, std::int64_t after = 0) const;
  // At most so many of those written after one sequence and up to another, in their order.
  [[nodiscard]] Expected<std::vector<Event>> since(std::int64_t after, std::int64_t last, std::int64_t most) const;
  // The sequence of the last event that was written, and of the last that a commit has made durable; of one opened for
  // writing.
  [[nodiscard]] std::int64_t newest() const;
  [[nodiscard]] std::int64_t durable() const;
  // How many tasks have ended; likewise, and at no cost.
  [[nodiscard]] std::int64_t ended() const;
  // Every event, task by task in the order of their ids, those of no task first. Stops at the first error of `take`.
  [[nodiscard]] Expected<void> each_event(const std::function<Expected<void>(const Event&)>& take) const;
  [[nodiscard]] Expected<Counts> counts() const;
  // How many bytes the file may still grow by: what is free on its disk, or what this process may write of it, where
  // that is less. Nothing where nobody here can tell: in a database, in memory, through a VFS.
  [[nodiscard]] std::optional<std::uint64_t> room() const;
  // From now on each wait for the disk is timed by that clock.
  void time_commits(std::function<Time()> clock);
  // The longest of them since the last call; 0 without a clock.
  [[nodiscard]] Duration take_longest_commit() const;
  // Of this opening; the first is 1.
  [[nodiscard]] std::int64_t run() const;

  // Drops what happened to ended tasks between acceptance and outcome, but for the `keep` (0 or more) that ended last;
  // ids stay taken and outcomes known. With them go the notes of where their parcels were seen and carried, but for
  // what each robot held last. Then gives the freed space back to the disk. Returns how many events were
  // dropped; a note says so, too. Error: the file cannot be written, it holds what it held; or no space was freed.
  [[nodiscard]] Expected<std::int64_t> compact(std::int64_t keep);
  // Whether the file itself is whole, as far as its database can tell. Error: what is not.
  [[nodiscard]] Expected<void> check_storage() const;

 private:
  struct Impl;
  explicit Journal(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::bridge
