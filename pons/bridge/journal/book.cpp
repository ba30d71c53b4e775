#include "pons/bridge/journal/book.hpp"

#include <fmt/format.h>

#include <utility>

#include "pons/bridge/journal/layout.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/postgres.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge {

struct OrderBook::Impl {
  std::unique_ptr<Database> database;
};

namespace {

Expected<std::unique_ptr<Database>> connect(const std::string& place, Mode mode) {
  if (!in_database(place))
    return fail("an order book lies in a PostgreSQL database", shown(place), "write postgresql://HOST/DATABASE");
  return open_postgres(split(place).connection, kBookSchema, mode);
}

}  // namespace

Expected<std::unique_ptr<OrderBook>> OrderBook::open(const std::string& place) {
  auto database = connect(place, Mode::kTurn);
  if (!database) return std::unexpected(database.error());
  if (auto there = ensure_book(**database); !there) return std::unexpected(there.error());
  return std::unique_ptr<OrderBook>(new OrderBook(std::make_unique<Impl>(std::move(*database))));
}

Expected<std::unique_ptr<OrderBook>> OrderBook::open_to_read(const std::string& place) {
  auto database = connect(place, Mode::kRead);
  if (!database) return std::unexpected(database.error());
  const auto layout = book_layout_of(**database);
  if (!layout) return std::unexpected(layout.error());
  if (*layout == Layout::kNone)
    return fail("there is no order book", (*database)->shown(), "the first order makes one: pons book submit");
  return std::unique_ptr<OrderBook>(new OrderBook(std::make_unique<Impl>(std::move(*database))));
}

OrderBook::OrderBook(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

OrderBook::~OrderBook() = default;

Expected<Accepted> OrderBook::submit(const task::Task& task) {
  if (task.deadline)
    return fail("an order has no deadline", "/deadline_s", "it would count from the begin of some bridge's run");
  const std::string body = task::to_json(task).dump();
  if (body.size() > task::kMaxJsonBytes) {
    return fail(fmt::format("{} bytes of JSON, with what it does not say itself", body.size()), {},
                fmt::format("send at most {} bytes", task::kMaxJsonBytes));
  }
  auto insert = impl_->database->prepare(
      "INSERT INTO pons.book(id, priority, body) VALUES(?1, ?2, ?3) ON CONFLICT (id) DO NOTHING RETURNING number");
  if (!insert) return std::unexpected(insert.error());
  const auto number = insert->bind(task.id).bind(task.priority).bind(body).run_for_integer();
  if (!number) return std::unexpected(number.error());
  if (*number > 0) return Accepted::kNew;
  auto find = impl_->database->prepare("SELECT body FROM pons.book WHERE id = ?1");
  if (!find) return std::unexpected(find.error());
  const auto row = find->bind(task.id).step();
  if (!row) return std::unexpected(row.error());
  if (*row && find->text(0) == body) return Accepted::kAlready;
  return fail(fmt::format("the id '{}' belongs to another task", task.id), "/id", "choose an id that was never used");
}

Expected<std::vector<OrderRecord>> OrderBook::orders(Which which) const {
  auto rows = impl_->database->prepare(
      fmt::format("SELECT id, priority, date_trunc('second', submitted), claimed_by, outcome, reason FROM pons.book {} "
                  "ORDER BY number",
                  which == Which::kOpen ? "WHERE outcome IS NULL" : ""));
  if (!rows) return std::unexpected(rows.error());
  std::vector<OrderRecord> records;
  for (;;) {
    const auto row = rows->step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return records;
    OrderRecord record{rows->text(0), static_cast<int>(rows->integer(1)), rows->text(2), rows->text(3), {},
                       rows->text(5)};
    if (!rows->is_null(4)) {
      const auto outcome = task::outcome_from(rows->text(4));
      if (!outcome) return std::unexpected(outcome.error());
      record.outcome = *outcome;
    }
    records.push_back(std::move(record));
  }
}

}  // namespace pons::bridge
