#include "pons/bridge/journal/journal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "pons/bridge/journal/layout.hpp"
#include "pons/bridge/journal/sqlite.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

constexpr std::string_view kTaskColumns =
    "SELECT a.task, a.run, a.stamp_ns, a.detail, e.run, e.stamp_ns, e.detail, "
    "EXISTS(SELECT 1 FROM event s WHERE s.task = a.task AND s.kind = 'started') "
    "FROM event a INDEXED BY one_acceptance LEFT JOIN event e ON e.task = a.task AND e.kind = 'ended' "
    "WHERE a.kind = 'accepted' ";
constexpr std::string_view kEventColumns = "SELECT sequence, run, stamp_ns, task, order_id, kind, detail FROM event ";

// Labels are read from pictures: a code need not be UTF-8.
std::string written(const Json& json) {
  return json.is_null() ? "{}" : json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

const std::string& order_of(const task::Task& task) { return task.order.empty() ? task.id : task.order; }

Json ending(task::Outcome outcome, std::string_view reason, const Json& detail) {
  return {{"outcome", task::name(outcome)}, {"reason", reason}, {"detail", detail}};
}

Expected<OutcomeRecord> outcome_from(const Json& ending) {
  const auto outcome = task::outcome_from(task::text_of(ending, "outcome"));
  if (!outcome) return std::unexpected(outcome.error());
  return OutcomeRecord{*outcome, task::text_of(ending, "reason"), ending.value("detail", Json::object())};
}

std::unexpected<Error> reserved(std::string_view kind) {
  return fail(fmt::format("'{}' is a word of the journal's own", kind), "journal", "note it under another");
}

}  // namespace

struct Journal::Impl {
  std::string file;
  Database database;
  std::int64_t run = 0;
  Time last;            // stamp that was written in this run
  bool behind = false;  // the clock is, since it ran back
  // Nothing is written any more. Whether SQLite took back what came before a failed write depends on why it failed, and
  // what was to become durable together must not become so in part.
  std::optional<Error> failed;
  // Only open_to_read() leaves those that write unprepared.
  mutable Statement find_task, all_tasks, one_task, events_of_task, notes, events_of_order, every_event, count, newest;
  std::int64_t durable = 0;
  Statement add_first, add_event, add_note, begin, commit;

  [[nodiscard]] Expected<void> begin_run();
  [[nodiscard]] Expected<void> prepare(Database::Mode mode);
  [[nodiscard]] Expected<void> ensure_transaction();
  [[nodiscard]] Expected<void> make_durable();
  [[nodiscard]] Expected<void> look_up_durable();
  [[nodiscard]] Expected<void> write(Statement& statement);
  // A transaction, and the stamp for what is written now: a clock that runs back is told of, and waited for.
  [[nodiscard]] Expected<std::int64_t> begin_at(Time now);
  // To an open task.
  [[nodiscard]] Expected<void> add(std::string_view id, Time now, std::string_view kind, const Json& detail);
  [[nodiscard]] Expected<TaskRecord> read_task(const Statement& row) const;
  [[nodiscard]] Expected<Event> read_event(const Statement& row) const;
  // Reads to the end.
  [[nodiscard]] Expected<void> each_of(Statement& rows, const std::function<Expected<void>(const Event&)>& take) const;
  [[nodiscard]] Expected<std::vector<Event>> all_of(Statement& rows) const;
  [[nodiscard]] std::unexpected<Error> broken(std::string_view what) const {
    return fail(fmt::format("a record is broken: {}", what), file, "restore a copy, or name another file");
  }
};

// ---- opening ----

namespace {

Expected<void> check_place(const std::filesystem::path& file) {
  std::error_code ignored;
  const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder, ignored)) {
    return fail(fmt::format("the folder '{}' does not exist", folder.string()), file.string(),
                "create it, or name another file for the journal");
  }
  if (std::filesystem::is_directory(file, ignored)) {
    return fail("this is a folder", file.string(), "name a file for the journal");
  }
  return {};
}

std::unexpected<Error> older(const std::string& file) {
  return fail("this journal is of an older version", file, "bring it to this one: pons journal upgrade FILE");
}

}  // namespace

Expected<void> Journal::Impl::begin_run() {
  if (auto done = database.execute("BEGIN IMMEDIATE;INSERT INTO run DEFAULT VALUES;COMMIT;"); !done) return done;
  const auto id = database.integer("SELECT max(id) FROM run");
  if (!id) return std::unexpected(id.error());
  run = *id;
  return {};
}

Expected<void> Journal::Impl::prepare(Database::Mode mode) {
  const auto make = [this](Statement& statement, std::string_view sql) -> Expected<void> {
    auto prepared = database.prepare(sql);
    if (!prepared) return std::unexpected(prepared.error());
    statement = std::move(*prepared);
    return {};
  };
  const std::string tasks(kTaskColumns), events(kEventColumns);
  const std::array<std::pair<Statement*, std::string>, 9> reads{{
      {&find_task, "SELECT detail FROM event WHERE task = ?1 AND kind = 'accepted'"},
      {&all_tasks, tasks + "ORDER BY a.sequence"},
      {&one_task, tasks + "AND a.task = ?1"},
      {&events_of_task, events + "WHERE task = ?1 AND kind NOT IN ('accepted', 'ended') ORDER BY sequence"},
      {&notes, events + "WHERE task = '' ORDER BY sequence"},
      {&events_of_order, events + "WHERE ?1 <> '' AND sequence > ?2 AND sequence IN (SELECT sequence FROM event WHERE "
                                  "order_id = ?1 AND order_id <> '' "
                                  "UNION SELECT e.sequence FROM event a JOIN event e ON e.task = a.task "
                                  "WHERE a.order_id = ?1 AND a.order_id <> '' AND a.kind = 'accepted' "
                                  "UNION SELECT sequence FROM event WHERE task = ?1) ORDER BY sequence"},
      {&every_event, events + "ORDER BY task, sequence"},
      {&newest, "SELECT coalesce(max(sequence), 0) FROM event"},
      {&count,
       "SELECT (SELECT count(*) FROM event WHERE kind = 'accepted'), (SELECT count(*) FROM event), "
       "coalesce(sum(o = 'SUCCEEDED'), 0), coalesce(sum(o = 'FAILED'), 0), coalesce(sum(o = 'CANCELLED'), 0), "
       "coalesce(sum(o = 'EXCEPTION'), 0) "
       "FROM (SELECT json_extract(detail, '$.outcome') AS o FROM event WHERE kind = 'ended')"},
  }};
  const std::array<std::pair<Statement*, std::string>, 5> writes{{
      {&add_first,
       "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(?1, ?2, ?3, ?4, 'accepted', ?5) "
       "ON CONFLICT DO NOTHING"},
      {&add_event,
       "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) "
       "SELECT ?1, ?2, ?5, '', ?3, ?4 WHERE EXISTS(SELECT 1 FROM event WHERE task = ?5 AND kind = 'accepted') "
       "AND NOT EXISTS(SELECT 1 FROM event WHERE task = ?5 AND kind = 'ended')"},
      {&add_note, "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(?1, ?2, '', ?3, ?4, ?5)"},
      {&begin, "BEGIN IMMEDIATE"},
      {&commit, "COMMIT"},
  }};
  for (const auto& [statement, sql] : reads) {
    if (auto made = make(*statement, sql); !made) return made;
  }
  if (mode == Database::Mode::kRead) return {};
  for (const auto& [statement, sql] : writes) {
    if (auto made = make(*statement, sql); !made) return made;
  }
  return {};
}

Expected<std::unique_ptr<Journal>> Journal::open(const std::filesystem::path& file, const char* vfs) {
  auto impl = std::make_unique<Impl>();
  impl->file = file.string();
  const bool in_memory = impl->file == ":memory:";
  const auto steps = [&]() -> Expected<void> {
    if (!in_memory) {
      if (auto place = check_place(file); !place) return place;
    }
    if (auto opened = impl->database.open(impl->file, Database::Mode::kCreate, vfs); !opened) return opened;
    // The lock is kept from the first access to the end: one owner, and no index in shared memory.
    if (auto locked = impl->database.execute("PRAGMA locking_mode=EXCLUSIVE"); !locked) return locked;
    const auto layout = layout_of(impl->database, impl->file);
    if (!layout) return std::unexpected(layout.error());
    if (*layout == Layout::kOlder) return older(impl->file);
    if (impl->database.read_only()) {
      return fail("the journal cannot be written", impl->file, "check the permissions of file and folder");
    }
    // A new file is created in rollback mode, so that its identity stands in the file itself and not only in the log.
    if (*layout == Layout::kNone) {
      if (auto created = create_layout(impl->database); !created) return created;
    }
    const auto log = impl->database.text("PRAGMA journal_mode=WAL");
    if (!log) return std::unexpected(log.error());
    if (*log != (in_memory ? "memory" : "wal")) {
      return fail("this disk takes no write-ahead log", impl->file, "name a file on a local disk");
    }
    if (auto set = impl->database.execute("PRAGMA synchronous=FULL;PRAGMA foreign_keys=ON"); !set) return set;
    if (auto begun = impl->begin_run(); !begun) return begun;
    if (auto prepared = impl->prepare(Database::Mode::kCreate); !prepared) return prepared;
    (void)impl->look_up_durable();  // of a damaged file `check` tells more
    return {};
  };
  if (auto done = steps(); !done) return std::unexpected(done.error());
  return std::unique_ptr<Journal>(new Journal(std::move(impl)));
}

Expected<void> Journal::upgrade(const std::filesystem::path& file) {
  Database database;
  if (auto place = check_place(file); !place) return place;
  if (auto opened = database.open(file.string(), Database::Mode::kCreate); !opened) return opened;
  if (auto locked = database.execute("PRAGMA locking_mode=EXCLUSIVE;PRAGMA synchronous=FULL"); !locked) return locked;
  const auto layout = layout_of(database, file.string());
  if (!layout) return std::unexpected(layout.error());
  return *layout == Layout::kOlder ? upgrade_layout(database) : Expected<void>{};
}

Expected<std::unique_ptr<Journal>> Journal::open_to_read(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return fail("there is no such journal", file.string(), "name the file that a run was given with --journal");
  }
  auto impl = std::make_unique<Impl>();
  impl->file = file.string();
  const auto steps = [&]() -> Expected<void> {
    if (auto place = check_place(file); !place) return place;
    if (auto opened = impl->database.open(impl->file, Database::Mode::kRead); !opened) return opened;
    const auto layout = layout_of(impl->database, impl->file);
    if (!layout) return std::unexpected(layout.error());
    if (*layout == Layout::kNone) {
      return fail("this database is not a journal", impl->file, "name another file, or move this one away");
    }
    if (*layout == Layout::kOlder) return older(impl->file);
    return impl->prepare(Database::Mode::kRead);
  };
  if (auto done = steps(); !done) return std::unexpected(done.error());
  return std::unique_ptr<Journal>(new Journal(std::move(impl)));
}

Journal::Journal(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Journal::~Journal() {
  // Nobody was told that pending events are durable; losing them when the disk fails now breaks no promise.
  if (impl_->run != 0) (void)impl_->make_durable();
}

// ---- writing ----

Expected<void> Journal::Impl::ensure_transaction() {
  if (run == 0) return fail("the journal is open for reading only", file, "");
  if (failed) return std::unexpected(*failed);
  return database.in_transaction() ? Expected<void>{} : begin.run();
}

Expected<void> Journal::Impl::write(Statement& statement) {
  auto done = statement.run();
  if (done) return done;
  failed = done.error();
  if (database.in_transaction()) (void)database.execute("ROLLBACK");
  return done;
}

Expected<void> Journal::Impl::make_durable() {
  if (failed) return std::unexpected(*failed);
  if (!database.in_transaction()) return {};
  // The log would go on into a file that no name leads to any more.
  if (database.moved()) {
    (void)database.execute("ROLLBACK");
    failed = Error{"the journal's file is gone", file, "put it back where it was, and start again"};
    return std::unexpected(*failed);
  }
  if (auto done = write(commit); !done) return done;
  return look_up_durable();
}

Expected<void> Journal::Impl::look_up_durable() {
  Reading reading(newest);
  const auto row = newest.step();
  if (!row) return std::unexpected(row.error());
  durable = newest.integer(0);
  return {};
}

Expected<std::int64_t> Journal::Impl::begin_at(Time now) {
  if (auto begun = ensure_transaction(); !begun) return std::unexpected(begun.error());
  if (now < last && !behind) {
    add_note.bind(run).bind(last.ns()).bind("").bind(kClockBackEvent).bind(written({{"by_s", to_s(last - now)}}));
    if (auto noted = write(add_note); !noted) return std::unexpected(noted.error());
  }
  behind = now < last;
  last = std::max(last, now);
  return last.ns();
}

Expected<void> Journal::Impl::add(std::string_view id, Time now, std::string_view kind, const Json& detail) {
  const auto stamp = begin_at(now);
  if (!stamp) return std::unexpected(stamp.error());
  add_event.bind(run).bind(*stamp).bind(kind).bind(written(detail)).bind(id);
  if (auto added = write(add_event); !added) return added;
  if (database.changes() == 1) return {};
  return fail(fmt::format("there is no open task '{}'", task::excerpt(id)), file, "");
}

Expected<bool> Journal::holds(const task::Task& task) const {
  Reading reading(impl_->find_task);
  const auto row = impl_->find_task.bind(task.id).step();
  if (!row) return std::unexpected(row.error());
  if (!*row) return false;
  if (impl_->find_task.text(0) == written(task::to_json(task))) return true;
  return fail(fmt::format("the id '{}' belongs to another task", task.id), "/id", "choose an id that was never used");
}

Expected<Accepted> Journal::accept(const task::Task& task, Time now) {
  const auto stamp = impl_->begin_at(now);
  if (!stamp) return std::unexpected(stamp.error());
  impl_->add_first.bind(impl_->run).bind(*stamp).bind(task.id).bind(order_of(task));
  impl_->add_first.bind(written(task::to_json(task)));
  if (auto added = impl_->write(impl_->add_first); !added) return std::unexpected(added.error());
  if (impl_->database.changes() == 1) return Accepted::kNew;
  if (auto held = holds(task); !held) return std::unexpected(held.error());
  return Accepted::kAlready;
}

Expected<void> Journal::event(std::string_view id, Time now, std::string_view kind, const Json& detail) {
  if (kind == kAcceptedEvent || kind == kEndedEvent) return reserved(kind);
  return impl_->add(id, now, kind, detail);
}

Expected<void> Journal::note(Time now, std::string_view kind, const Json& detail, std::string_view order) {
  if (kind == kAcceptedEvent || kind == kStartedEvent || kind == kEndedEvent) return reserved(kind);
  const auto stamp = impl_->begin_at(now);
  if (!stamp) return std::unexpected(stamp.error());
  return impl_->write(impl_->add_note.bind(impl_->run).bind(*stamp).bind(order).bind(kind).bind(written(detail)));
}

Expected<void> Journal::outcome(std::string_view id, task::Outcome outcome, std::string_view reason, Time now,
                                const Json& detail) {
  return impl_->add(id, now, kEndedEvent, ending(outcome, reason, detail));
}

Expected<void> Journal::commit() { return impl_->make_durable(); }

Expected<std::int64_t> Journal::compact(std::int64_t keep) {
  assert(keep >= 0);
  if (auto durable = commit(); !durable) return std::unexpected(durable.error());
  const auto drop = [&]() -> Expected<std::int64_t> {
    auto dropped = impl_->database.prepare(
        "DELETE FROM event WHERE kind NOT IN ('accepted', 'ended') AND task IN (SELECT task FROM event WHERE kind = "
        "'ended' AND sequence <= (SELECT sequence FROM event WHERE kind = 'ended' ORDER BY sequence DESC LIMIT 1 "
        "OFFSET ?1))");
    if (!dropped) return std::unexpected(dropped.error());
    if (auto done = impl_->write(dropped->bind(keep)); !done) return std::unexpected(done.error());
    return impl_->database.changes();
  };
  if (auto begun = impl_->ensure_transaction(); !begun) return std::unexpected(begun.error());
  const auto dropped = drop();
  if (!dropped) return dropped;
  if (*dropped > 0) {
    if (auto noted = note(impl_->last, kCompactedEvent, {{"events", *dropped}}); !noted)
      return std::unexpected(noted.error());
  }
  if (auto durable = commit(); !durable) return std::unexpected(durable.error());
  if (auto freed = impl_->database.execute("VACUUM"); !freed) return std::unexpected(freed.error());
  return dropped;
}

// ---- reading ----

Expected<TaskRecord> Journal::Impl::read_task(const Statement& row) const {
  const Json json = Json::parse(row.text(3), nullptr, false);
  if (json.is_discarded()) return broken("a task is not JSON");
  auto task = task::task_from(json);
  if (!task) return broken(task.error().line());
  if (task->id != row.text(0)) return broken(fmt::format("task '{}' stands under '{}'", task->id, row.text(0)));
  TaskRecord record{std::move(*task), row.integer(1), Time(Duration(row.integer(2))), row.integer(7) != 0,
                    std::nullopt};
  if (row.is_null(4)) return record;
  auto end = outcome_from(Json::parse(row.text(6), nullptr, false));
  if (!end) return broken(end.error().line());
  end->run = row.integer(4);
  end->stamp = Time(Duration(row.integer(5)));
  record.outcome = std::move(*end);
  return record;
}

Expected<Event> Journal::Impl::read_event(const Statement& row) const {
  Json detail = Json::parse(row.text(6), nullptr, false);
  if (!detail.is_object()) return broken(fmt::format("the detail of event {} is no JSON object", row.integer(0)));
  return Event{row.integer(0), row.text(3),      row.text(4), row.integer(1), Time(Duration(row.integer(2))),
               row.text(5),    std::move(detail)};
}

Expected<void> Journal::Impl::each_of(Statement& rows, const std::function<Expected<void>(const Event&)>& take) const {
  Reading reading(rows);
  for (;;) {
    const auto row = rows.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return {};
    const auto event = read_event(rows);
    if (!event) return std::unexpected(event.error());
    if (auto taken = take(*event); !taken) return taken;
  }
}

Expected<std::vector<Event>> Journal::Impl::all_of(Statement& rows) const {
  std::vector<Event> events;
  const auto done = each_of(rows, [&events](const Event& event) -> Expected<void> {
    events.push_back(event);
    return {};
  });
  if (!done) return std::unexpected(done.error());
  return events;
}

Expected<std::vector<TaskRecord>> Journal::tasks() const {
  Reading reading(impl_->all_tasks);
  std::vector<TaskRecord> records;
  for (;;) {
    const auto row = impl_->all_tasks.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return records;
    auto record = impl_->read_task(impl_->all_tasks);
    if (!record) return std::unexpected(record.error());
    records.push_back(std::move(*record));
  }
}

Expected<std::optional<TaskHistory>> Journal::task(std::string_view id) const {
  Reading reading(impl_->one_task);
  const auto row = impl_->one_task.bind(id).step();
  if (!row) return std::unexpected(row.error());
  if (!*row) return std::nullopt;
  auto record = impl_->read_task(impl_->one_task);
  if (!record) return std::unexpected(record.error());
  auto happened = impl_->all_of(impl_->events_of_task.bind(id));
  if (!happened) return std::unexpected(happened.error());
  return TaskHistory{std::move(*record), std::move(*happened)};
}

Expected<std::vector<Event>> Journal::notes() const { return impl_->all_of(impl_->notes); }

std::int64_t Journal::durable() const { return impl_->durable; }

Expected<std::vector<Event>> Journal::history(std::string_view order, std::int64_t after) const {
  return impl_->all_of(impl_->events_of_order.bind(order).bind(after));
}

Expected<void> Journal::each_event(const std::function<Expected<void>(const Event&)>& take) const {
  return impl_->each_of(impl_->every_event, take);
}

Expected<Counts> Journal::counts() const {
  Reading reading(impl_->count);
  const auto row = impl_->count.step();
  if (!row) return std::unexpected(row.error());
  const Statement& r = impl_->count;
  Counts counts{r.integer(0), 0, r.integer(2), r.integer(3), r.integer(4), r.integer(5), r.integer(1)};
  counts.open = counts.accepted - counts.succeeded - counts.failed - counts.cancelled - counts.exception;
  return counts;
}

Expected<void> Journal::check_storage() const {
  const auto found = impl_->database.text("PRAGMA integrity_check");
  if (!found) return std::unexpected(found.error());
  if (*found != "ok") return fail("the journal is damaged: " + *found, impl_->file, "restore a copy");
  return {};
}

std::int64_t Journal::run() const { return impl_->run; }

}  // namespace pons::bridge
