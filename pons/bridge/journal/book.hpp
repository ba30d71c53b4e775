// The order book of a PostgreSQL database, as senders see it: tasks for whichever of its bridges has room next. Bridges
// take from it by Journal::claim(), so that each order is run by one of them and has one outcome, whoever dies when.
//
// One thread each; any number of them at once.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::bridge {

struct OrderRecord {
  std::string id;
  int priority = 50;
  std::string submitted;   // by the server's clock: "2026-01-31 12:00:00+00"
  std::string claimed_by;  // the bridge; empty: still free
  std::optional<task::Outcome> outcome;
  std::string reason;
};

class OrderBook {
 public:
  // `place` as in place.hpp; a bridge's name in it counts for nothing. open() makes a book where there is none. Errors:
  // not a database, not reached, so set up that no commit is durable, another version, or, to read, none there.
  [[nodiscard]] static Expected<std::unique_ptr<OrderBook>> open(const std::string& place);
  [[nodiscard]] static Expected<std::unique_ptr<OrderBook>> open_to_read(const std::string& place);
  ~OrderBook();

  // Durable when it returns. Errors: another task has this id; it has a deadline, which counts in the time of one
  // bridge's run; the book cannot be written (it may have been taken all the same: submit the same again).
  [[nodiscard]] Expected<Accepted> submit(const task::Task& task);

  enum class Which : std::uint8_t { kAll, kOpen };  // open: without an outcome
  // In the order of submission.
  [[nodiscard]] Expected<std::vector<OrderRecord>> orders(Which which) const;

 private:
  struct Impl;
  explicit OrderBook(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::bridge
