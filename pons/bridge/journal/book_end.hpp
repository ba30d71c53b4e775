// The bridge's end of the order book, on the connection of its journal and in its transactions: an order is claimed
// with its acceptance or not at all, and has its outcome when its task has.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/bridge/journal/database.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge {

class BookEnd {
 public:
  // Of a PostgreSQL database, which outlives it; the book is made where there is none.
  [[nodiscard]] static Expected<BookEnd> open(Database& database);

  // Whether there is an order of at least that priority that nobody has claimed. Locks nothing.
  [[nodiscard]] Expected<bool> waits(int least);
  // Within a transaction.
  [[nodiscard]] Expected<std::vector<Order>> claim(std::size_t most, int least, Duration ageing);
  // The ids of all that this bridge has claimed and that have not ended.
  [[nodiscard]] Expected<std::set<std::string>> claimed();
  [[nodiscard]] Expected<void> close(std::string_view id, task::Outcome outcome, std::string_view reason);

 private:
  explicit BookEnd(std::string bridge) : bridge_(std::move(bridge)) {}

  std::string bridge_;
  Statement waits_, claim_, claimed_, close_;
};

}  // namespace pons::bridge
