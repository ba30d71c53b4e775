#include "pons/bridge/journal/database.hpp"

namespace pons::bridge {

Expected<void> Statement::run() {
  auto done = run_for_integer();
  if (!done) return std::unexpected(done.error());
  return {};
}

Expected<std::int64_t> Statement::run_for_integer() {
  Reading reading(*this);
  std::int64_t first = 0;
  for (bool any = false;; any = true) {
    const auto row = step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return first;
    if (!any) first = integer(0);
  }
}

Expected<std::int64_t> Database::integer(std::string_view sql) {
  auto statement = prepare(sql);
  if (!statement) return std::unexpected(statement.error());
  return statement->run_for_integer();
}

Expected<std::string> Database::text(std::string_view sql) {
  auto statement = prepare(sql);
  if (!statement) return std::unexpected(statement.error());
  const auto row = statement->step();
  if (!row) return std::unexpected(row.error());
  return *row ? statement->text(0) : std::string();
}

Expected<void> Database::in_one_transaction(const std::string& script) {
  const std::string begin = dialect() == Dialect::kSqlite ? "BEGIN EXCLUSIVE;" : "BEGIN;";
  auto done = execute(begin + script + "COMMIT;");
  if (!done && in_transaction()) (void)execute("ROLLBACK");
  return done;
}

}  // namespace pons::bridge
