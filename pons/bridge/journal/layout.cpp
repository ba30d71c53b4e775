#include "pons/bridge/journal/layout.hpp"

#include <fmt/format.h>

#include <cassert>
#include <charconv>
#include <string>

#include "pons/bridge/journal/journal.hpp"

namespace pons::bridge {
namespace {

// Only acceptances and notes name an order: what happens to a task belongs to its task's.
// The two unique indexes are what keeps a task from being accepted or ended twice, whoever writes. An event is never
// changed, and what says that a task was accepted or how it ended is never dropped.
constexpr const char* kRuns = R"sql(
CREATE TABLE run(
  id INTEGER PRIMARY KEY
) STRICT;
)sql";
constexpr const char* kEvents = R"sql(
CREATE TABLE event(
  sequence INTEGER PRIMARY KEY,
  run      INTEGER NOT NULL REFERENCES run(id),
  stamp_ns INTEGER NOT NULL,
  task     TEXT    NOT NULL,
  order_id TEXT    NOT NULL,
  kind     TEXT    NOT NULL,
  detail   TEXT    NOT NULL,
  CHECK(task <> '' OR kind NOT IN ('accepted', 'started', 'ended'))
) STRICT;
CREATE UNIQUE INDEX one_acceptance ON event(task) WHERE kind = 'accepted';
CREATE UNIQUE INDEX one_end ON event(task) WHERE kind = 'ended';
CREATE INDEX event_of_task ON event(task);
CREATE INDEX of_order ON event(order_id) WHERE order_id <> '';
CREATE TRIGGER event_stays BEFORE UPDATE ON event
  BEGIN SELECT RAISE(ABORT, 'events are never changed'); END;
CREATE TRIGGER ends_stay BEFORE DELETE ON event WHEN OLD.kind IN ('accepted', 'ended')
  BEGIN SELECT RAISE(ABORT, 'acceptances and outcomes are never dropped'); END;
)sql";

// The same in PostgreSQL, in the schema {0}. An order is any text, and may be too long for a B-tree.
constexpr const char* kPostgresTables = R"sql(
CREATE TABLE "{0}".run(
  id BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY
);
CREATE TABLE "{0}".event(
  sequence BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  run      BIGINT NOT NULL REFERENCES "{0}".run(id),
  stamp_ns BIGINT NOT NULL,
  task     TEXT   COLLATE "C" NOT NULL,
  order_id TEXT   COLLATE "C" NOT NULL,
  kind     TEXT   COLLATE "C" NOT NULL,
  detail   TEXT   NOT NULL,
  CHECK(task <> '' OR kind NOT IN ('accepted', 'started', 'ended'))
);
CREATE UNIQUE INDEX one_acceptance ON "{0}".event(task) WHERE kind = 'accepted';
CREATE UNIQUE INDEX one_end ON "{0}".event(task) WHERE kind = 'ended';
CREATE INDEX event_of_task ON "{0}".event(task);
CREATE INDEX of_order ON "{0}".event USING hash (order_id) WHERE order_id <> '';
CREATE FUNCTION "{0}".refuse() RETURNS trigger LANGUAGE plpgsql AS
  $$ BEGIN RAISE EXCEPTION USING MESSAGE = TG_ARGV[0], ERRCODE = 'integrity_constraint_violation'; END $$;
CREATE TRIGGER event_stays BEFORE UPDATE ON "{0}".event
  FOR EACH ROW EXECUTE FUNCTION "{0}".refuse('events are never changed');
CREATE TRIGGER ends_stay BEFORE DELETE ON "{0}".event
  FOR EACH ROW WHEN (OLD.kind IN ('accepted', 'ended'))
  EXECUTE FUNCTION "{0}".refuse('acceptances and outcomes are never dropped');
CREATE TRIGGER all_stay BEFORE TRUNCATE ON "{0}".event
  FOR EACH STATEMENT EXECUTE FUNCTION "{0}".refuse('acceptances and outcomes are never dropped');
)sql";

// An order is claimed once, ends once, and is never changed or dropped otherwise: its id stays taken.
constexpr const char* kBook = R"sql(
CREATE TABLE pons.book(
  number     BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  id         TEXT COLLATE "C" NOT NULL UNIQUE,
  priority   INTEGER NOT NULL,
  body       TEXT NOT NULL,
  submitted  TIMESTAMPTZ NOT NULL DEFAULT now(),
  claimed_by TEXT,
  claimed    TIMESTAMPTZ,
  outcome    TEXT CHECK(outcome IN ('SUCCEEDED', 'FAILED', 'CANCELLED', 'EXCEPTION')),
  reason     TEXT,
  ended      TIMESTAMPTZ,
  CHECK((claimed_by IS NULL) = (claimed IS NULL)),
  CHECK((outcome IS NULL) = (ended IS NULL) AND (outcome IS NULL) = (reason IS NULL)),
  CHECK(outcome IS NULL OR claimed_by IS NOT NULL)
);
CREATE INDEX free ON pons.book(priority DESC, number) WHERE claimed_by IS NULL;
CREATE INDEX oldest ON pons.book(number) WHERE claimed_by IS NULL;
CREATE FUNCTION pons.refuse() RETURNS trigger LANGUAGE plpgsql AS
  $$ BEGIN RAISE EXCEPTION USING MESSAGE = TG_ARGV[0], ERRCODE = 'integrity_constraint_violation'; END $$;
CREATE TRIGGER claims_and_outcomes_stay BEFORE UPDATE ON pons.book
  FOR EACH ROW WHEN (OLD.outcome IS NOT NULL OR NEW.id <> OLD.id OR NEW.priority <> OLD.priority OR
    NEW.body <> OLD.body OR (OLD.claimed_by IS NOT NULL AND NEW.claimed_by IS DISTINCT FROM OLD.claimed_by))
  EXECUTE FUNCTION pons.refuse('an order is claimed once and ends once');
CREATE TRIGGER orders_stay BEFORE DELETE ON pons.book
  FOR EACH ROW EXECUTE FUNCTION pons.refuse('orders are never dropped');
CREATE TRIGGER all_stay BEFORE TRUNCATE ON pons.book
  FOR EACH STATEMENT EXECUTE FUNCTION pons.refuse('orders are never dropped');
)sql";

// Version 1 kept tasks, events and outcomes in tables of their own. What one of its tasks began with and ended with
// comes before and after its other events of the same moment. It did not say which steps were found done.
constexpr const char* kMakeRoom1 = R"sql(
ALTER TABLE event RENAME TO old_event;
DROP INDEX event_of_task;
)sql";
constexpr const char* kMove1 = R"sql(
INSERT INTO event(run, stamp_ns, task, order_id, kind, detail)
SELECT run, stamp_ns, task, order_id, kind, detail FROM (
  SELECT run, accepted_ns AS stamp_ns, id AS task, id AS order_id, 'accepted' AS kind, body AS detail, 0 AS rank,
         sequence FROM task
  UNION ALL
  SELECT e.run, e.stamp_ns, coalesce(t.id, ''), iif(t.id IS NULL, coalesce(json_extract(e.detail, '$.code'), ''), ''),
         e.kind, e.detail, 1, e.sequence FROM old_event e LEFT JOIN task t ON t.sequence = e.task
  UNION ALL
  SELECT o.run, o.stamp_ns, t.id, '', 'found_done', json_object('step', s.key), 2, s.key
    FROM outcome o JOIN task t ON t.sequence = o.task JOIN json_each(t.body, '$.steps') s
    WHERE o.outcome = 'SUCCEEDED' AND EXISTS(SELECT 1 FROM old_event e WHERE e.task = o.task AND e.kind = 'started')
      AND NOT EXISTS(SELECT 1 FROM old_event e WHERE e.task = o.task AND e.kind = 'attempt_ended'
        AND json_extract(e.detail, '$.step') = s.key AND json_extract(e.detail, '$.status') = 'succeeded')
  UNION ALL
  SELECT o.run, o.stamp_ns, t.id, '', 'ended',
         json_object('outcome', o.outcome, 'reason', o.reason, 'detail', json(o.detail)), 3, o.task
    FROM outcome o JOIN task t ON t.sequence = o.task)
ORDER BY run, stamp_ns, rank, sequence;
DROP TABLE old_event;
DROP TABLE outcome;
DROP TABLE task;
)sql";

std::string identity() {
  return fmt::format("PRAGMA application_id={};PRAGMA user_version={};", Journal::kApplicationId, Journal::kVersion);
}

// What a schema is for, and the version that this program writes.
struct Kind {
  std::string schema;
  std::string_view is;
  int version;
};

Kind journal_in(const Database& database) { return {database.schema(), "Pons journal", Journal::kVersion}; }
Kind book() { return {kBookSchema, "Pons order book", kBookVersion}; }

std::unexpected<Error> other_version(std::string_view what, std::int64_t version, int own, const std::string& where) {
  return fail(fmt::format("this {} has version {}, this program reads version {}", what, version, own), where,
              "use the program that wrote it, or name another place");
}

std::string create_schema(const Kind& kind, bool there, const std::string& tables) {
  return fmt::format("{0}{1}COMMENT ON SCHEMA \"{2}\" IS '{3}, version {4}';",
                     there ? "" : fmt::format("CREATE SCHEMA \"{}\";", kind.schema), tables, kind.schema, kind.is,
                     kind.version);
}

Expected<bool> is_there(Database& database, const Kind& kind) {
  const auto found =
      database.integer(fmt::format("SELECT count(*) FROM pg_namespace WHERE nspname = '{}'", kind.schema));
  if (!found) return std::unexpected(found.error());
  return *found > 0;
}

Expected<Layout> schema_layout(Database& database, const Kind& kind) {
  const auto said = database.text(fmt::format(
      "SELECT coalesce(obj_description(oid, 'pg_namespace'), '') FROM pg_namespace WHERE nspname = '{}'", kind.schema));
  if (!said) return std::unexpected(said.error());
  const auto objects = database.integer(fmt::format(
      "SELECT count(*) FROM pg_class JOIN pg_namespace n ON n.oid = relnamespace WHERE nspname = '{}'", kind.schema));
  if (!objects) return std::unexpected(objects.error());
  if (said->empty() && *objects == 0) return Layout::kNone;
  const std::string mark = fmt::format("{}, version ", kind.is);
  if (!said->starts_with(mark)) {
    return fail(fmt::format("the schema '{}' is another program's", kind.schema), database.shown(),
                "name another bridge or database, or move that schema away");
  }
  int version = 0;
  std::from_chars(said->data() + mark.size(), said->data() + said->size(), version);
  if (version == kind.version) return Layout::kThis;
  return other_version(kind.schema == kBookSchema ? "order book" : "journal", version, kind.version, database.shown());
}

}  // namespace

std::string journal_schema(std::string_view bridge) { return fmt::format("pons_{}", bridge); }

Expected<Layout> layout_of(Database& database) {
  if (database.dialect() == Dialect::kPostgres) return schema_layout(database, journal_in(database));
  const auto application = database.integer("PRAGMA application_id");
  if (!application) return std::unexpected(application.error());
  const auto version = database.integer("PRAGMA user_version");
  if (!version) return std::unexpected(version.error());
  const auto objects = database.integer("SELECT count(*) FROM sqlite_schema");
  if (!objects) return std::unexpected(objects.error());
  if (*application == 0 && *version == 0 && *objects == 0) return Layout::kNone;
  if (*application != Journal::kApplicationId) {
    return fail("this database is not a journal", database.shown(), "name another file, or move this one away");
  }
  if (*version < 1 || *version > Journal::kVersion)
    return other_version("journal", *version, Journal::kVersion, database.shown());
  return *version == Journal::kVersion ? Layout::kThis : Layout::kOlder;
}

Expected<void> create_layout(Database& database) {
  if (database.dialect() == Dialect::kSqlite)
    return database.in_one_transaction(std::string(kRuns) + kEvents + identity());
  const auto there = is_there(database, journal_in(database));
  if (!there) return std::unexpected(there.error());
  const std::string tables = fmt::format(fmt::runtime(kPostgresTables), database.schema());
  return database.in_one_transaction(create_schema(journal_in(database), *there, tables));
}

Expected<void> upgrade_layout(Database& database) {
  assert(database.dialect() == Dialect::kSqlite);
  return database.in_one_transaction(std::string(kMakeRoom1) + kEvents + kMove1 + identity());
}

Expected<Layout> book_layout_of(Database& database) { return schema_layout(database, book()); }

Expected<void> ensure_book(Database& database) {
  // The lock ends with the session or here; who waited for it finds the book.
  const auto locked = database.execute("SELECT pg_advisory_lock(hashtextextended('pons order book', 0))");
  if (!locked) return locked;
  const auto create = [&]() -> Expected<void> {
    const auto layout = book_layout_of(database);
    if (!layout) return std::unexpected(layout.error());
    if (*layout == Layout::kThis) return {};
    const auto there = is_there(database, book());
    if (!there) return std::unexpected(there.error());
    return database.in_one_transaction(create_schema(book(), *there, kBook));
  };
  const auto created = create();
  const auto unlocked = database.execute("SELECT pg_advisory_unlock(hashtextextended('pons order book', 0))");
  return created ? unlocked : created;
}

std::string_view acceptances(Dialect dialect) {
  return dialect == Dialect::kSqlite ? "event a INDEXED BY one_acceptance" : "event a";
}

std::string_view in_their_order(Dialect dialect) {
  return dialect == Dialect::kSqlite ? "event a NOT INDEXED" : "event a";
}

Expected<void> check_layout(Database& database) {
  if (database.dialect() == Dialect::kSqlite) {
    const auto found = database.text("PRAGMA integrity_check");
    if (!found) return std::unexpected(found.error());
    if (*found == "ok") return {};
    std::string line = *found;
    std::ranges::replace(line, '\n', ' ');
    return fail("the journal is damaged: " + line, {}, "restore a copy");
  }
  // Pages the server checks as it reads them, where it has checksums; the rules may be dropped by whoever owns them.
  const auto rules = database.integer(fmt::format(
      "SELECT (SELECT count(*) FROM pg_index JOIN pg_class c ON c.oid = indexrelid JOIN pg_namespace n ON n.oid = "
      "c.relnamespace WHERE nspname = '{0}' AND relname IN ('one_acceptance', 'one_end') AND indisunique AND "
      "indisvalid) + (SELECT count(*) FROM pg_trigger JOIN pg_class c ON c.oid = tgrelid JOIN pg_namespace n ON n.oid "
      "= c.relnamespace WHERE nspname = '{0}' AND tgname IN ('event_stays', 'ends_stay', 'all_stay') AND tgenabled = "
      "'O')",
      database.schema()));
  if (!rules) return std::unexpected(rules.error());
  if (*rules == 5) return {};
  return fail("the journal is damaged: an index or a trigger that guards it is missing", database.shown(),
              "restore a copy");
}

Expected<void> give_back_space(Database& database) {
  return database.execute(database.dialect() == Dialect::kSqlite ? "VACUUM" : "VACUUM FULL event");
}

}  // namespace pons::bridge
