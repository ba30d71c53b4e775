// What a journal has in hand, for the files that it is written in.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/journal/book_end.hpp"
#include "pons/bridge/journal/database.hpp"
#include "pons/bridge/journal/journal.hpp"

namespace pons::bridge {

struct Journal::Impl {
  std::string file;  // or database, for people
  std::unique_ptr<Database> database;
  std::optional<BookEnd> book;  // of a journal in a database, opened for writing
  std::int64_t run = 0;
  Time last;            // stamp that was written in this run
  bool behind = false;  // the clock is, since it ran back
  // Nothing is written any more. Whether SQLite took back what came before a failed write depends on why it failed, and
  // what was to become durable together must not become so in part.
  std::optional<Error> failed;
  bool pending = false;  // a transaction was begun and is not committed
  // Only open_to_read() leaves those that write unprepared.
  mutable Statement find_task, tasks_after, one_task, open_tasks, ended_tasks, events_of_task, outline, notes_after,
      events_of_order, news_of_order, events_since, every_event, count, count_ended, endings, newest;
  std::int64_t last_written = 0, durable = 0;  // sequences
  std::int64_t ended = 0;                      // tasks
  std::function<Time()> clock;                 // none: nobody asks how long a commit takes
  Duration longest_commit{0};
  Statement add_first, add_event, add_note, drop_told, drop_before, begin, commit;

  [[nodiscard]] Expected<void> begin_run();
  [[nodiscard]] Expected<std::int64_t> drop(std::int64_t keep, std::int64_t still_true);
  [[nodiscard]] Expected<void> prepare(Mode mode);
  [[nodiscard]] Expected<void> ensure_transaction();
  // Error, for good: a read that failed, as for want of memory or of its server, may have ended the transaction.
  [[nodiscard]] Expected<void> still_pending();
  [[nodiscard]] Expected<void> make_durable();
  [[nodiscard]] Expected<void> look_up_what_is_there();
  // The sequence of what was inserted; 0 when nothing was.
  [[nodiscard]] Expected<std::int64_t> write(Statement& statement);
  void give_up(const Error& error);
  // A transaction, and the stamp for what is written now: a clock that runs back is told of, and waited for.
  [[nodiscard]] Expected<std::int64_t> begin_at(Time now);
  // To an open task.
  [[nodiscard]] Expected<void> add(std::string_view id, Time now, std::string_view kind, const Json& detail);
  [[nodiscard]] Expected<TaskRecord> read_task(const Statement& row) const;
  [[nodiscard]] Expected<std::vector<TaskRecord>> tasks_of(Statement& rows) const;
  [[nodiscard]] Expected<Event> read_event(const Statement& row) const;
  // Reads to the end.
  [[nodiscard]] Expected<void> each_of(Statement& rows, const std::function<Expected<void>(const Event&)>& take) const;
  [[nodiscard]] Expected<std::vector<Event>> all_of(Statement& rows) const;
  [[nodiscard]] std::unexpected<Error> broken(std::string_view what) const {
    return fail(fmt::format("a record is broken: {}", what), file, "restore a copy, or name another file");
  }
};

}  // namespace pons::bridge
