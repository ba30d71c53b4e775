#include "pons/bridge/journal/book_end.hpp"

#include <algorithm>
#include <array>
#include <chrono>

#include "pons/bridge/journal/layout.hpp"

namespace pons::bridge {

Expected<BookEnd> BookEnd::open(Database& database) {
  if (auto there = ensure_book(database); !there) return std::unexpected(there.error());
  BookEnd end(database.name());
  // What another bridge is about to take is as good as taken: who waited for it would hold up its own robot. The locked
  // rows come first, by themselves: no plan can lock more than it takes. Of all that wait the oldest alone is asked
  // about its age, which one index tells: once it is taken another is the oldest, so nobody starves.
  const std::array<std::pair<Statement*, std::string_view>, 4> statements{{
      {&end.waits_, "SELECT 1 FROM pons.book WHERE claimed_by IS NULL AND priority >= ?1 LIMIT 1"},
      {&end.claim_,
       "WITH aged AS MATERIALIZED (SELECT number FROM pons.book WHERE claimed_by IS NULL AND ?3 = 0 "
       "AND number = (SELECT number FROM pons.book WHERE claimed_by IS NULL ORDER BY number LIMIT 1) "
       "AND priority + floor(1000 * extract(epoch FROM clock_timestamp() - submitted) / ?4) "
       "> (SELECT priority FROM pons.book WHERE claimed_by IS NULL ORDER BY priority DESC LIMIT 1) "
       "FOR UPDATE SKIP LOCKED), "
       "free AS MATERIALIZED (SELECT number FROM pons.book WHERE claimed_by IS NULL AND priority >= ?3 "
       "AND number NOT IN (SELECT number FROM aged) "
       "ORDER BY priority DESC, number LIMIT ?2 - (SELECT count(*) FROM aged) FOR UPDATE SKIP LOCKED), "
       "mine AS (UPDATE pons.book b SET claimed_by = ?1, claimed = clock_timestamp() "
       "WHERE b.number IN (SELECT number FROM aged UNION ALL SELECT number FROM free) "
       "RETURNING b.number, b.priority, b.id, b.body) "
       "SELECT id, body FROM mine ORDER BY priority DESC, number"},
      {&end.claimed_, "SELECT id FROM pons.book WHERE claimed_by = ?1 AND outcome IS NULL"},
      {&end.close_,
       "UPDATE pons.book SET outcome = ?1, reason = ?2, ended = clock_timestamp() "
       "WHERE id = ?3 AND claimed_by = ?4 AND outcome IS NULL"},
  }};
  for (const auto& [statement, sql] : statements) {
    auto prepared = database.prepare(sql);
    if (!prepared) return std::unexpected(prepared.error());
    *statement = std::move(*prepared);
  }
  return end;
}

Expected<bool> BookEnd::waits(int least) {
  const auto found = waits_.bind(std::int64_t{least}).run_for_integer();
  if (!found) return std::unexpected(found.error());
  return *found == 1;
}

Expected<std::vector<Order>> BookEnd::claim(std::size_t most, int least, Duration ageing) {
  Reading reading(claim_);
  const std::int64_t ageing_ms = std::max<std::int64_t>(1, ageing / std::chrono::milliseconds(1));
  claim_.bind(bridge_).bind(static_cast<std::int64_t>(most)).bind(std::int64_t{least}).bind(ageing_ms);
  std::vector<Order> orders;
  for (;;) {
    const auto row = claim_.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return orders;
    orders.push_back({claim_.text(0), claim_.text(1)});
  }
}

Expected<std::set<std::string>> BookEnd::claimed() {
  Reading reading(claimed_);
  claimed_.bind(bridge_);
  std::set<std::string> ids;
  for (;;) {
    const auto row = claimed_.step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return ids;
    ids.insert(claimed_.text(0));
  }
}

Expected<void> BookEnd::close(std::string_view id, task::Outcome outcome, std::string_view reason) {
  return close_.bind(task::name(outcome)).bind(reason).bind(id).bind(bridge_).run();
}

}  // namespace pons::bridge
