#include "pons/bridge/journal/layout.hpp"

#include <fmt/format.h>

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

Expected<void> in_one_transaction(const Database& database, const std::string& script) {
  auto done = database.execute(("BEGIN EXCLUSIVE;" + script + "COMMIT;").c_str());
  if (!done && database.in_transaction()) (void)database.execute("ROLLBACK");
  return done;
}

}  // namespace

Expected<Layout> layout_of(const Database& database, const std::string& file) {
  const auto application = database.integer("PRAGMA application_id");
  if (!application) return std::unexpected(application.error());
  const auto version = database.integer("PRAGMA user_version");
  if (!version) return std::unexpected(version.error());
  const auto objects = database.integer("SELECT count(*) FROM sqlite_schema");
  if (!objects) return std::unexpected(objects.error());
  if (*application == 0 && *version == 0 && *objects == 0) return Layout::kNone;
  if (*application != Journal::kApplicationId) {
    return fail("this database is not a journal", file, "name another file, or move this one away");
  }
  if (*version < 1 || *version > Journal::kVersion) {
    return fail(fmt::format("this journal has version {}, this program reads version {}", *version, Journal::kVersion),
                file, "use the program that wrote it, or name another file");
  }
  return *version == Journal::kVersion ? Layout::kThis : Layout::kOlder;
}

Expected<void> create_layout(const Database& database) {
  return in_one_transaction(database, std::string(kRuns) + kEvents + identity());
}

Expected<void> upgrade_layout(const Database& database) {
  return in_one_transaction(database, std::string(kMakeRoom1) + kEvents + kMove1 + identity());
}

}  // namespace pons::bridge
