#include "pons/bridge/journal/journal_impl.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <map>
#include <utility>

#include "pons/bridge/journal/layout.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/postgres.hpp"
#include "pons/bridge/journal/sqlite.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {
namespace {

constexpr std::string_view kTaskColumns =
    "SELECT a.task, a.run, a.stamp_ns, a.detail, e.run, e.stamp_ns, e.detail, "
    "CASE WHEN EXISTS(SELECT 1 FROM event s WHERE s.task = a.task AND s.kind = 'started') THEN 1 ELSE 0 END, "
    "a.sequence "
    "FROM {} LEFT JOIN event e ON e.task = a.task AND e.kind = 'ended' WHERE a.kind = 'accepted' ";
constexpr std::string_view kEventColumns = "SELECT sequence, run, stamp_ns, task, order_id, kind, detail FROM event ";

// Labels are read from pictures: a code need not be UTF-8.
std::string written(const Json& json) {
  return json.is_null() ? "{}" : json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

const std::string& order_of(const task::Task& task) { return task.order.empty() ? task.id : task.order; }

Json ending(task::Outcome outcome, std::string_view reason, const Json& detail) {
  return {{"outcome", task::name(outcome)}, {"reason", reason}, {"detail", detail}};
}

std::unexpected<Error> reserved(std::string_view kind) {
  return fail(fmt::format("'{}' is a word of the journal's own", kind), "journal", "note it under another");
}

}  // namespace

// ---- opening ----

namespace {

Expected<std::unique_ptr<Database>> connect(const std::string& place, Mode mode, const char* vfs) {
  if (!in_database(place)) return open_sqlite(place, mode, vfs);
  const std::string name = split(place).name;
  if (auto good = check_name(name); !good) return std::unexpected(good.error());
  return open_postgres(place, journal_schema(name), mode);
}

std::unexpected<Error> older(const std::string& file) {
  return fail("this journal is of an older version", file, "bring it to this one: pons journal upgrade FILE");
}

}  // namespace

Expected<void> Journal::Impl::begin_run() {
  auto insert = database->prepare("INSERT INTO run DEFAULT VALUES RETURNING id");
  if (!insert) return std::unexpected(insert.error());
  const auto id = insert->run_for_integer();
  if (!id) return std::unexpected(id.error());
  run = *id;
  return {};
}

Expected<void> Journal::Impl::prepare(Mode mode) {
  const auto make = [this](Statement& statement, std::string_view sql) -> Expected<void> {
    auto prepared = database->prepare(sql);
    if (!prepared) return std::unexpected(prepared.error());
    statement = std::move(*prepared);
    return {};
  };
  const std::string tasks = fmt::format(kTaskColumns, acceptances(database->dialect())), events(kEventColumns);
  const std::string in_order = fmt::format(kTaskColumns, in_their_order(database->dialect()));
  const std::array<std::pair<Statement*, std::string>, 16> reads{{
      {&find_task, "SELECT detail FROM event WHERE task = ?1 AND kind = 'accepted'"},
      {&tasks_after, in_order + "AND a.sequence > ?1 ORDER BY a.sequence LIMIT ?2"},
      {&one_task, tasks + "AND a.task = ?1"},
      {&open_tasks, tasks + "AND e.sequence IS NULL ORDER BY a.sequence"},
      {&ended_tasks, in_order + "AND a.sequence < ?1 AND e.sequence IS NOT NULL ORDER BY a.sequence DESC LIMIT ?2"},
      {&events_of_task, events + "WHERE task = ?1 AND kind NOT IN ('accepted', 'ended') ORDER BY sequence"},
      {&outline,
       "SELECT sequence, run, stamp_ns, task, order_id, kind, CASE WHEN kind = ?1 THEN '{}' ELSE detail END FROM event "
       "WHERE task = ?2 ORDER BY sequence"},
      {&notes_after, events + "WHERE task = '' AND sequence > ?1 ORDER BY sequence LIMIT ?2"},
      {&events_of_order, events + "WHERE ?1 <> '' AND sequence > ?2 AND sequence IN (SELECT sequence FROM event WHERE "
                                  "order_id = ?1 AND order_id <> '' "
                                  "UNION SELECT e.sequence FROM event a JOIN event e ON e.task = a.task "
                                  "WHERE a.order_id = ?1 AND a.order_id <> '' AND a.kind = 'accepted' "
                                  "UNION SELECT sequence FROM event WHERE task = ?1) ORDER BY sequence"},
      {&news_of_order, events +
                           "AS n WHERE ?1 <> '' AND sequence > ?2 AND (order_id = ?1 OR task = ?1 OR EXISTS(SELECT 1 "
                           "FROM event a WHERE a.task = n.task AND a.kind = 'accepted' AND a.order_id = ?1)) "
                           "ORDER BY sequence"},
      {&events_since, events + "WHERE sequence > ?1 AND sequence <= ?2 ORDER BY sequence LIMIT ?3"},
      {&every_event, events + "ORDER BY task, sequence"},
      {&newest, "SELECT coalesce(max(sequence), 0) FROM event"},
      {&count, "SELECT count(*) FILTER (WHERE kind = 'accepted'), count(*) FROM event"},
      {&count_ended, "SELECT count(*) FROM event WHERE kind = 'ended'"},
      {&endings, "SELECT detail FROM event WHERE kind = 'ended'"},
  }};
  const std::string returning = database->dialect() == Dialect::kSqlite ? "" : " RETURNING sequence";
  const std::string open_still = "AND NOT EXISTS(SELECT 1 FROM event e WHERE e.task = ?1 AND e.kind = 'ended')";
  const std::array<std::pair<Statement*, std::string>, 7> writes{{
      {&add_first,
       "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(?1, ?2, ?3, ?4, 'accepted', ?5) "
       "ON CONFLICT DO NOTHING" +
           returning},
      {&add_event,
       "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) "
       "SELECT ?1, ?2, ?5, '', ?3, ?4 WHERE EXISTS(SELECT 1 FROM event WHERE task = ?5 AND kind = 'accepted') "
       "AND NOT EXISTS(SELECT 1 FROM event WHERE task = ?5 AND kind = 'ended')" +
           returning},
      {&add_note,
       "INSERT INTO event(run, stamp_ns, task, order_id, kind, detail) VALUES(?1, ?2, '', ?3, ?4, ?5)" + returning},
      {&drop_told, fmt::format("DELETE FROM event WHERE task = ?1 AND kind = '{}' ", kLeftOutEvent) + open_still},
      {&drop_before,
       "DELETE FROM event WHERE task = ?1 AND sequence < ?2 AND kind NOT IN ('accepted', 'started', 'ended') "
       "AND ?3 NOT LIKE '%,' || sequence || ',%' " +
           open_still},
      {&begin, database->dialect() == Dialect::kSqlite ? "BEGIN IMMEDIATE" : "BEGIN"},
      {&commit, "COMMIT"},
  }};
  for (const auto& [statement, sql] : reads) {
    if (auto made = make(*statement, sql); !made) return made;
  }
  if (mode == Mode::kRead) return {};
  for (const auto& [statement, sql] : writes) {
    if (auto made = make(*statement, sql); !made) return made;
  }
  return {};
}

Expected<std::unique_ptr<Journal>> Journal::open(const std::string& place, const char* vfs) {
  auto database = connect(place, Mode::kOwn, vfs);
  if (!database) return std::unexpected(database.error());
  auto impl = std::make_unique<Impl>();
  impl->file = (*database)->shown();
  impl->database = std::move(*database);
  const auto steps = [&]() -> Expected<void> {
    const auto layout = layout_of(*impl->database);
    if (!layout) return std::unexpected(layout.error());
    if (*layout == Layout::kOlder) return older(impl->file);
    if (*layout == Layout::kNone) {
      if (auto created = create_layout(*impl->database); !created) return created;
    }
    if (auto promised = impl->database->promise_durability(); !promised) return promised;
    if (auto begun = impl->begin_run(); !begun) return begun;
    if (auto prepared = impl->prepare(Mode::kOwn); !prepared) return prepared;
    (void)impl->look_up_what_is_there();  // of a damaged file `check` tells more
    if (impl->database->dialect() == Dialect::kSqlite) return {};
    auto book = BookEnd::open(*impl->database);
    if (!book) return std::unexpected(book.error());
    impl->book = std::move(*book);
    return {};
  };
  if (auto done = steps(); !done) return std::unexpected(done.error());
  return std::unique_ptr<Journal>(new Journal(std::move(impl)));
}

Expected<void> Journal::upgrade(const std::string& place) {
  auto database = connect(place, Mode::kOwn, nullptr);
  if (!database) return std::unexpected(database.error());
  const auto layout = layout_of(**database);
  if (!layout) return std::unexpected(layout.error());
  return *layout == Layout::kOlder ? upgrade_layout(**database) : Expected<void>{};
}

Expected<std::unique_ptr<Journal>> Journal::open_to_read(const std::string& place) {
  auto database = connect(place, Mode::kRead, nullptr);
  if (!database) return std::unexpected(database.error());
  auto impl = std::make_unique<Impl>();
  impl->file = (*database)->shown();
  impl->database = std::move(*database);
  const auto steps = [&]() -> Expected<void> {
    const auto layout = layout_of(*impl->database);
    if (!layout) return std::unexpected(layout.error());
    if (*layout == Layout::kOlder) return older(impl->file);
    if (*layout == Layout::kThis) return impl->prepare(Mode::kRead);
    if (impl->database->dialect() == Dialect::kSqlite)
      return fail("this database is not a journal", impl->file, "name another file, or move this one away");
    return fail("there is no such journal", impl->file, "name the bridge that writes it");
  };
  if (auto done = steps(); !done) return std::unexpected(done.error());
  return std::unique_ptr<Journal>(new Journal(std::move(impl)));
}

Journal::Journal(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Journal::~Journal() {
  // Nobody was told that pending events are durable; losing them when the disk fails now breaks no promise.
  if (impl_->run != 0) (void)impl_->make_durable();
}

void Journal::abandon() {
  if (!impl_->failed) impl_->give_up({"the journal was abandoned", impl_->file, "open it anew"});
}

// ---- writing ----

Expected<void> Journal::Impl::ensure_transaction() {
  if (run == 0) return fail("the journal is open for reading only", file, "");
  if (failed) return std::unexpected(*failed);
  if (pending) return still_pending();
  auto begun = begin.run();
  if (!begun) give_up(begun.error());
  pending = begun.has_value();
  return begun;
}

Expected<void> Journal::Impl::still_pending() {
  if (database->in_transaction()) return {};
  const auto there = database->still_there();
  give_up(there
              ? Error{"the database took back what was not committed yet", file, "start again: what was told is there"}
              : there.error());
  return std::unexpected(*failed);
}

void Journal::Impl::give_up(const Error& error) {
  if (database->in_transaction()) (void)database->execute("ROLLBACK");
  failed = error;
}

Expected<std::int64_t> Journal::Impl::write(Statement& statement) {
  if (auto done = statement.run(); !done) {
    give_up(done.error());
    return std::unexpected(done.error());
  }
  const std::int64_t sequence = database->inserted();
  if (sequence > 0) last_written = sequence;
  return sequence;
}

Expected<void> Journal::Impl::make_durable() {
  if (failed) return std::unexpected(*failed);
  if (!pending) return {};
  if (auto whole = still_pending(); !whole) return whole;
  if (auto there = database->still_there(); !there) {
    give_up(there.error());
    return there;
  }
  const Time began = clock ? clock() : Time{};
  const auto done = write(commit);
  if (clock) longest_commit = std::max(longest_commit, clock() - began);
  if (!done) return std::unexpected(done.error());
  pending = false;
  durable = std::max(durable, last_written);
  return {};
}

Expected<void> Journal::Impl::look_up_what_is_there() {
  const auto last_one = newest.run_for_integer();
  if (!last_one) return std::unexpected(last_one.error());
  durable = *last_one;
  const auto outcomes = count_ended.run_for_integer();
  if (!outcomes) return std::unexpected(outcomes.error());
  ended = *outcomes;
  return {};
}

std::optional<std::uint64_t> Journal::room() const { return impl_->database->room(); }

void Journal::time_commits(std::function<Time()> clock) { impl_->clock = std::move(clock); }

Duration Journal::take_longest_commit() const { return std::exchange(impl_->longest_commit, Duration{0}); }

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
  const auto added = write(add_event);
  if (!added) return std::unexpected(added.error());
  if (*added > 0) return {};
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
  const auto added = impl_->write(impl_->add_first);
  if (!added) return std::unexpected(added.error());
  if (*added > 0) return Accepted::kNew;
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
  const auto noted =
      impl_->write(impl_->add_note.bind(impl_->run).bind(*stamp).bind(order).bind(kind).bind(written(detail)));
  return noted ? Expected<void>{} : std::unexpected(noted.error());
}

Expected<void> Journal::outcome(std::string_view id, task::Outcome outcome, std::string_view reason, Time now,
                                const Json& detail) {
  if (auto added = impl_->add(id, now, kEndedEvent, ending(outcome, reason, detail)); !added) return added;
  ++impl_->ended;
  return close_order(id, outcome, reason);
}

Expected<void> Journal::leave_out(std::string_view id, Time now, std::int64_t before, const std::set<std::int64_t>& but,
                                  std::int64_t so_far) {
  if (auto begun = impl_->ensure_transaction(); !begun) return begun;
  if (auto told = impl_->write(impl_->drop_told.bind(id)); !told) return std::unexpected(told.error());
  const std::string stay = fmt::format(",{},", fmt::join(but, ","));
  if (auto done = impl_->write(impl_->drop_before.bind(id).bind(before).bind(stay)); !done)
    return std::unexpected(done.error());
  return impl_->add(id, now, kLeftOutEvent, {{"events", so_far + impl_->database->changes()}});
}

Expected<void> Journal::commit() { return impl_->make_durable(); }

// ---- the order book beside it ----

Expected<std::vector<Order>> Journal::claim(std::size_t most, int least, Duration ageing) {
  std::vector<Order> none;
  if (!impl_->book || most == 0) return none;
  if (impl_->failed) return std::unexpected(*impl_->failed);
  const auto waits = impl_->book->waits(least);
  if (waits && !*waits) return none;
  if (waits) {
    if (auto begun = impl_->ensure_transaction(); !begun) return std::unexpected(begun.error());
  }
  auto orders = waits ? impl_->book->claim(most, least, ageing) : std::unexpected(waits.error());
  if (!orders) impl_->give_up(orders.error());
  return orders;
}

Expected<std::set<std::string>> Journal::claimed() {
  return impl_->book ? impl_->book->claimed() : Expected<std::set<std::string>>{};
}

Expected<void> Journal::close_order(std::string_view id, task::Outcome outcome, std::string_view reason) {
  if (!impl_->book) return {};
  if (auto begun = impl_->ensure_transaction(); !begun) return begun;
  auto closed = impl_->book->close(id, outcome, reason);
  if (!closed) impl_->give_up(closed.error());
  return closed;
}

// In this transaction. Notes from `still_true` on stay, and of orders with an open task.
Expected<std::int64_t> Journal::Impl::drop(std::int64_t keep, std::int64_t still_true) {
  constexpr std::string_view kUpTo =
      "(SELECT sequence FROM event WHERE kind = 'ended' ORDER BY sequence DESC LIMIT 1 OFFSET ?1)";
  auto of_tasks =
      database->prepare(fmt::format("DELETE FROM event WHERE kind NOT IN ('accepted', 'ended') AND task IN "
                                    "(SELECT task FROM event WHERE kind = 'ended' AND sequence <= {})",
                                    kUpTo));
  if (!of_tasks) return std::unexpected(of_tasks.error());
  auto of_orders = database->prepare(fmt::format(
      "DELETE FROM event WHERE task = '' AND order_id <> '' AND kind IN ('{}', '{}') AND sequence < ?2 AND sequence <= "
      "{} "
      "AND order_id NOT IN (SELECT a.order_id FROM event a LEFT JOIN event e ON e.task = a.task AND e.kind = 'ended' "
      "WHERE a.kind = 'accepted' AND e.sequence IS NULL)",
      kSeenEvent, kCarriesEvent, kUpTo));
  if (!of_orders) return std::unexpected(of_orders.error());
  if (auto done = write(of_tasks->bind(keep)); !done) return std::unexpected(done.error());
  const std::int64_t dropped = database->changes();
  if (auto done = write(of_orders->bind(keep).bind(still_true)); !done) return std::unexpected(done.error());
  return dropped + database->changes();
}

Expected<std::int64_t> Journal::compact(std::int64_t keep) {
  assert(keep >= 0);
  if (auto durable = commit(); !durable) return std::unexpected(durable.error());
  std::map<std::string, std::int64_t> held;  // by robot: the note of what it held last
  auto read = each_note([&](const Event& event) -> Expected<void> {
    if (event.kind == kCarriesEvent) held[task::text_of(event.detail, "robot")] = event.sequence;
    return {};
  });
  if (!read) return std::unexpected(read.error());
  std::int64_t still_true = std::numeric_limits<std::int64_t>::max();
  for (const auto& [robot, sequence] : held) still_true = std::min(still_true, sequence);
  if (auto begun = impl_->ensure_transaction(); !begun) return std::unexpected(begun.error());
  const auto dropped = impl_->drop(keep, still_true);
  if (!dropped) return dropped;
  if (*dropped > 0) {
    if (auto noted = note(impl_->last, kCompactedEvent, {{"events", *dropped}}); !noted)
      return std::unexpected(noted.error());
  }
  if (auto durable = commit(); !durable) return std::unexpected(durable.error());
  if (auto freed = give_back_space(*impl_->database); !freed) return std::unexpected(freed.error());
  return dropped;
}

}  // namespace pons::bridge
