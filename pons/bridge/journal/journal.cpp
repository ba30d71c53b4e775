#include "pons/bridge/journal/journal.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "pons/bridge/journal/sqlite.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

constexpr const char* kSchema = R"sql(
CREATE TABLE run(
  id INTEGER PRIMARY KEY
) STRICT;
CREATE TABLE task(
  sequence    INTEGER PRIMARY KEY,
  id          TEXT    NOT NULL UNIQUE,
  run         INTEGER NOT NULL REFERENCES run(id),
  accepted_ns INTEGER NOT NULL,
  body        TEXT    NOT NULL
) STRICT;
CREATE TABLE outcome(
  task     INTEGER NOT NULL UNIQUE REFERENCES task(sequence),
  outcome  TEXT    NOT NULL CHECK(outcome IN ('SUCCEEDED', 'FAILED', 'CANCELLED', 'EXCEPTION')),
  reason   TEXT    NOT NULL,
  detail   TEXT    NOT NULL,
  run      INTEGER NOT NULL REFERENCES run(id),
  stamp_ns INTEGER NOT NULL
) STRICT;
CREATE TABLE event(
  sequence INTEGER PRIMARY KEY,
  task     INTEGER REFERENCES task(sequence),
  run      INTEGER NOT NULL REFERENCES run(id),
  stamp_ns INTEGER NOT NULL,
  kind     TEXT    NOT NULL,
  detail   TEXT    NOT NULL
) STRICT;
CREATE INDEX event_of_task ON event(task, sequence);
)sql";

constexpr std::string_view kTaskColumns =
    "SELECT t.body, t.run, t.accepted_ns, o.outcome, o.reason, o.detail, o.run, o.stamp_ns, "
    "EXISTS(SELECT 1 FROM event e WHERE e.task = t.sequence AND e.kind = 'started') "
    "FROM task t LEFT JOIN outcome o ON o.task = t.sequence ";

// Labels are read from pictures: a code need not be UTF-8.
std::string written(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace

struct Journal::Impl {
  std::string file;
  Database database;
  std::int64_t run = 0;
  // Only open_to_read() leaves those that write unprepared.
  mutable Statement find_body, all_tasks, one_task, events_of_task, other_events, count;
  Statement add_task, add_outcome, add_event, add_other_event, begin, commit;

  [[nodiscard]] Expected<void> check_identity(Database::Mode mode, bool& empty) const;
  [[nodiscard]] Expected<void> create() const;
  [[nodiscard]] Expected<void> begin_run();
  [[nodiscard]] Expected<void> prepare(Database::Mode mode);
  [[nodiscard]] Expected<void> ensure_transaction();
  [[nodiscard]] Expected<void> make_durable();
  [[nodiscard]] Expected<TaskRecord> read_task(const Statement& row) const;
  [[nodiscard]] Expected<std::optional<std::string>> body(std::string_view id) const;
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

}  // namespace

Expected<void> Journal::Impl::check_identity(Database::Mode mode, bool& empty) const {
  const auto application = database.integer("PRAGMA application_id");
  if (!application) return std::unexpected(application.error());
  const auto version = database.integer("PRAGMA user_version");
  if (!version) return std::unexpected(version.error());
  const auto objects = database.integer("SELECT count(*) FROM sqlite_schema");
  if (!objects) return std::unexpected(objects.error());
  empty = *application == 0 && *version == 0 && *objects == 0;
  if (empty && mode == Database::Mode::kCreate) return {};
  if (*application != kApplicationId) {
    return fail("this database is not a journal", file, "name another file, or move this one away");
  }
  if (*version != kVersion) {
    return fail(fmt::format("this journal has version {}, this program reads version {}", *version, kVersion), file,
                "use the program that wrote it, or name another file");
  }
  return {};
}

Expected<void> Journal::Impl::create() const {
  const std::string script = fmt::format("BEGIN EXCLUSIVE;{}PRAGMA application_id={};PRAGMA user_version={};COMMIT;",
                                         kSchema, kApplicationId, kVersion);
  return database.execute(script.c_str());
}

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
  constexpr std::string_view kEvents = "SELECT sequence, run, stamp_ns, kind, detail FROM event WHERE task ";
  const std::string in_order = std::string(kTaskColumns) + "ORDER BY t.sequence";
  const std::string by_id = std::string(kTaskColumns) + "WHERE t.id = ?1";
  const std::string of_task = std::string(kEvents) + "= (SELECT sequence FROM task WHERE id = ?1) ORDER BY sequence";
  const std::string of_none = std::string(kEvents) + "IS NULL ORDER BY sequence";
  const std::array<std::pair<Statement*, std::string_view>, 6> reads{{
      {&find_body, "SELECT body FROM task WHERE id = ?1"},
      {&all_tasks, in_order},
      {&one_task, by_id},
      {&events_of_task, of_task},
      {&other_events, of_none},
      {&count,
       "SELECT (SELECT count(*) FROM task), (SELECT count(*) FROM event), coalesce(sum(outcome = 'SUCCEEDED'), 0), "
       "coalesce(sum(outcome = 'FAILED'), 0), coalesce(sum(outcome = 'CANCELLED'), 0), "
       "coalesce(sum(outcome = 'EXCEPTION'), 0) FROM outcome"},
  }};
  const std::array<std::pair<Statement*, std::string_view>, 6> writes{{
      {&add_task, "INSERT INTO task(id, run, accepted_ns, body) VALUES(?1, ?2, ?3, ?4)"},
      {&add_outcome,
       "INSERT INTO outcome(task, outcome, reason, detail, run, stamp_ns) "
       "SELECT t.sequence, ?2, ?3, ?4, ?5, ?6 FROM task t WHERE t.id = ?1 "
       "AND NOT EXISTS(SELECT 1 FROM outcome o WHERE o.task = t.sequence)"},
      {&add_event,
       "INSERT INTO event(task, run, stamp_ns, kind, detail) SELECT sequence, ?2, ?3, ?4, ?5 FROM task WHERE id = ?1"},
      {&add_other_event, "INSERT INTO event(task, run, stamp_ns, kind, detail) VALUES(NULL, ?1, ?2, ?3, ?4)"},
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

Expected<std::unique_ptr<Journal>> Journal::open(const std::filesystem::path& file) {
  constexpr auto kMode = Database::Mode::kCreate;
  auto impl = std::make_unique<Impl>();
  impl->file = file.string();
  const bool in_memory = impl->file == ":memory:";
  bool empty = false;
  const auto steps = [&]() -> Expected<void> {
    if (!in_memory) {
      if (auto place = check_place(file); !place) return place;
    }
    if (auto opened = impl->database.open(impl->file, kMode); !opened) return opened;
    // The lock is kept from the first access to the end: one owner, and no index in shared memory.
    if (auto locked = impl->database.execute("PRAGMA locking_mode=EXCLUSIVE"); !locked) return locked;
    if (auto known = impl->check_identity(kMode, empty); !known) return known;
    if (impl->database.read_only()) {
      return fail("the journal cannot be written", impl->file, "check the permissions of file and folder");
    }
    // A new file is created in rollback mode, so that its identity stands in the file itself and not only in the log.
    if (empty) {
      if (auto created = impl->create(); !created) return created;
    }
    const auto log = impl->database.text("PRAGMA journal_mode=WAL");
    if (!log) return std::unexpected(log.error());
    if (*log != (in_memory ? "memory" : "wal")) {
      return fail("this disk takes no write-ahead log", impl->file, "name a file on a local disk");
    }
    if (auto set = impl->database.execute("PRAGMA synchronous=FULL;PRAGMA foreign_keys=ON"); !set) return set;
    if (auto begun = impl->begin_run(); !begun) return begun;
    return impl->prepare(kMode);
  };
  if (auto done = steps(); !done) return std::unexpected(done.error());
  return std::unique_ptr<Journal>(new Journal(std::move(impl)));
}

Expected<std::unique_ptr<Journal>> Journal::open_to_read(const std::filesystem::path& file) {
  constexpr auto kMode = Database::Mode::kRead;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return fail("there is no such journal", file.string(), "name the file that a run was given with --journal");
  }
  auto impl = std::make_unique<Impl>();
  impl->file = file.string();
  bool empty = false;
  const auto steps = [&]() -> Expected<void> {
    if (auto place = check_place(file); !place) return place;
    if (auto opened = impl->database.open(impl->file, kMode); !opened) return opened;
    if (auto known = impl->check_identity(kMode, empty); !known) return known;
    return impl->prepare(kMode);
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
  return database.in_transaction() ? Expected<void>{} : begin.run();
}

Expected<void> Journal::Impl::make_durable() {
  if (!database.in_transaction()) return {};
  auto done = commit.run();
  // What could not be committed must not come to light with a later commit.
  if (!done && database.in_transaction()) (void)database.execute("ROLLBACK");
  return done;
}

Expected<std::optional<std::string>> Journal::Impl::body(std::string_view id) const {
  Reading reading(find_body);
  const auto row = find_body.bind(id).step();
  if (!row) return std::unexpected(row.error());
  return *row ? std::optional(find_body.text(0)) : std::nullopt;
}

Expected<bool> Journal::holds(const task::Task& task) const {
  const auto body = impl_->body(task.id);
  if (!body) return std::unexpected(body.error());
  if (!*body) return false;
  if (**body == written(task::to_json(task))) return true;
  return fail(fmt::format("the id '{}' belongs to another task", task.id), "/id", "choose an id that was never used");
}

Expected<Accepted> Journal::accept(const task::Task& task, Time now) {
  const auto held = holds(task);
  if (!held) return std::unexpected(held.error());
  if (*held) return Accepted::kAlready;
  if (auto begun = impl_->ensure_transaction(); !begun) return std::unexpected(begun.error());
  impl_->add_task.bind(task.id).bind(impl_->run).bind(now.ns()).bind(written(task::to_json(task)));
  if (auto added = impl_->add_task.run(); !added) return std::unexpected(added.error());
  if (auto durable = impl_->make_durable(); !durable) return std::unexpected(durable.error());
  return Accepted::kNew;
}

Expected<void> Journal::event(std::string_view id, Time now, std::string_view kind, const Json& detail) {
  if (auto begun = impl_->ensure_transaction(); !begun) return begun;
  if (id.empty()) {
    return impl_->add_other_event.bind(impl_->run).bind(now.ns()).bind(kind).bind(written(detail)).run();
  }
  impl_->add_event.bind(id).bind(impl_->run).bind(now.ns()).bind(kind).bind(written(detail));
  if (auto added = impl_->add_event.run(); !added) return added;
  if (impl_->database.changes() == 1) return {};
  return fail(fmt::format("there is no task '{}'", task::excerpt(id)), impl_->file, "");
}

Expected<void> Journal::outcome(std::string_view id, task::Outcome outcome, std::string_view reason, Time now,
                                const Json& detail) {
  if (auto begun = impl_->ensure_transaction(); !begun) return begun;
  impl_->add_outcome.bind(id)
      .bind(task::name(outcome))
      .bind(reason)
      .bind(written(detail))
      .bind(impl_->run)
      .bind(now.ns());
  if (auto added = impl_->add_outcome.run(); !added) return added;
  if (impl_->database.changes() != 1) {
    return fail(fmt::format("there is no open task '{}'", task::excerpt(id)), impl_->file, "");
  }
  return impl_->make_durable();
}

Expected<void> Journal::commit() { return impl_->make_durable(); }

// ---- reading ----

Expected<TaskRecord> Journal::Impl::read_task(const Statement& row) const {
  const Json json = Json::parse(row.text(0), nullptr, false);
  if (json.is_discarded()) return broken("a task is not JSON");
  auto task = task::task_from(json);
  if (!task) return broken(task.error().line());
  TaskRecord record{std::move(*task), row.integer(1), Time(Duration(row.integer(2))), row.integer(8) != 0,
                    std::nullopt};
  if (row.is_null(3)) return record;
  const auto outcome = task::outcome_from(row.text(3));
  if (!outcome) return broken(outcome.error().line());
  Json detail = Json::parse(row.text(5), nullptr, false);
  if (detail.is_discarded()) return broken("an outcome's detail is not JSON");
  record.outcome =
      OutcomeRecord{*outcome, row.text(4), std::move(detail), row.integer(6), Time(Duration(row.integer(7)))};
  return record;
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
  auto happened = events(id);
  if (!happened) return std::unexpected(happened.error());
  return TaskHistory{std::move(*record), std::move(*happened)};
}

Expected<std::vector<Event>> Journal::events(std::string_view id) const {
  Statement& rows = id.empty() ? impl_->other_events : impl_->events_of_task;
  Reading reading(rows);
  if (!id.empty()) rows.bind(id);
  std::vector<Event> events;
  for (;;) {
    const auto row = rows.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return events;
    Json detail = Json::parse(rows.text(4), nullptr, false);
    if (detail.is_discarded()) return impl_->broken("an event's detail is not JSON");
    events.push_back({rows.integer(0), std::string(id), rows.integer(1), Time(Duration(rows.integer(2))), rows.text(3),
                      std::move(detail)});
  }
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

std::int64_t Journal::run() const { return impl_->run; }

}  // namespace pons::bridge
