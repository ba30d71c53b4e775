#include "pons/bridge/journal/sqlite.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cassert>
#include <cerrno>
#include <filesystem>
#include <utility>

namespace pons::bridge {
namespace {

// Why the last call to the operating system for the log failed; 0 where that is not known.
int errno_of_log(sqlite3* database) {
  sqlite3_file* log = nullptr;
  int reason = 0;
  const bool there =
      sqlite3_file_control(database, "main", SQLITE_FCNTL_JOURNAL_POINTER, static_cast<void*>(&log)) == SQLITE_OK &&
      log != nullptr && log->pMethods != nullptr;
  if (there) (void)log->pMethods->xFileControl(log, SQLITE_FCNTL_LAST_ERRNO, &reason);
  return reason;
}

// One clear line for each way a file can be wrong.
std::unexpected<Error> failure(sqlite3* database, const std::string& file) {
  const int code = sqlite3_errcode(database);
  switch (code & 0xff) {
    case SQLITE_NOTADB:
    case SQLITE_FORMAT:
      return fail("this file is not a journal", file, "name another file, or move this one away");
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return fail("the journal is in use by another process", file, "end that one, or name another file");
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
    case SQLITE_AUTH:
      return fail("the journal cannot be opened", file, "check the permissions of file and folder");
    case SQLITE_READONLY:
      return fail("the journal cannot be written", file, "check the permissions of file and folder");
    case SQLITE_FULL:
      return fail("no space is left for the journal", file, "free some space on the disk");
    case SQLITE_CORRUPT:
      return fail("the journal is damaged", file, "restore a copy, or name another file");
    case SQLITE_IOERR: {
      // SQLite itself calls only ENOSPC full.
      const int reason = errno_of_log(database);
      if (reason == EFBIG || reason == EDQUOT)
        return fail("no space is left for the journal", file, "free some space on the disk, or raise the limit");
      return fail(fmt::format("the journal failed: {}", sqlite3_errmsg(database)), file, "check the disk");
    }
    default:
      return fail(fmt::format("the journal failed: {}", sqlite3_errmsg(database)), file, "check the disk");
  }
}

// A journal without a write-ahead log beside it is at rest. Said so, reading it needs no right to write in its folder
// and leaves nothing there.
std::string reading_uri(const std::string& file) {
  std::string uri = "file:";
  std::error_code ignored;
  const std::string real = std::filesystem::canonical(file, ignored).string();  // where the log lies, too
  for (const char letter : real) {
    if (letter == '?' || letter == '#' || letter == '%') {
      uri += fmt::format("%{:02x}", letter);
    } else {
      uri += letter;
    }
  }
  const bool at_rest = !std::filesystem::exists(real + "-wal", ignored);
  return uri + (at_rest ? "?immutable=1" : "?mode=ro");
}

}  // namespace

Statement::Statement(Statement&& other) noexcept
    : statement_(std::exchange(other.statement_, nullptr)), file_(std::move(other.file_)), bound_(other.bound_) {}

Statement& Statement::operator=(Statement&& other) noexcept {
  std::swap(statement_, other.statement_);
  std::swap(file_, other.file_);
  std::swap(bound_, other.bound_);
  return *this;
}

Statement::~Statement() { sqlite3_finalize(statement_); }

Statement& Statement::bind(std::int64_t value) {
  [[maybe_unused]] const int code = sqlite3_bind_int64(statement_, ++bound_, value);
  assert(code == SQLITE_OK);
  return *this;
}

Statement& Statement::bind(std::string_view value) {
  // A null pointer would bind NULL.
  const char* data = value.empty() ? "" : value.data();
  [[maybe_unused]] const int code =
      sqlite3_bind_text64(statement_, ++bound_, data, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
  assert(code == SQLITE_OK);
  return *this;
}

Statement& Statement::bind_null() {
  [[maybe_unused]] const int code = sqlite3_bind_null(statement_, ++bound_);
  assert(code == SQLITE_OK);
  return *this;
}

Expected<bool> Statement::step() {
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return failure(sqlite3_db_handle(statement_), file_);
}

Expected<void> Statement::run() {
  Reading reading(*this);
  for (;;) {
    const auto row = step();
    if (!row) return std::unexpected(row.error());
    if (!*row) return {};
  }
}

void Statement::reset() {
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
  bound_ = 0;
}

std::int64_t Statement::integer(int column) const { return sqlite3_column_int64(statement_, column); }

std::string Statement::text(int column) const {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
  return data == nullptr ? std::string()
                         : std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
}

bool Statement::is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }

Database::~Database() { sqlite3_close(database_); }

Expected<void> Database::open(const std::string& file, Mode mode, const char* vfs) {
  file_ = file;
  const bool create = mode == Mode::kCreate;
  const int flags = SQLITE_OPEN_NOMUTEX |
                    (create ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  const std::string name = create ? file : reading_uri(file);
  if (sqlite3_open_v2(name.c_str(), &database_, flags, vfs) != SQLITE_OK) {
    return failure(database_, file_);
  }
  return {};
}

Expected<Statement> Database::prepare(std::string_view sql) const {
  Statement statement;
  statement.file_ = file_;
  const int code =
      sqlite3_prepare_v2(database_, sql.data(), static_cast<int>(sql.size()), &statement.statement_, nullptr);
  if (code != SQLITE_OK) return failure(database_, file_);
  return statement;
}

Expected<void> Database::execute(const char* sql) const {
  if (sqlite3_exec(database_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) return failure(database_, file_);
  return {};
}

Expected<std::int64_t> Database::integer(std::string_view sql) const {
  auto statement = prepare(sql);
  if (!statement) return std::unexpected(statement.error());
  const auto row = statement->step();
  if (!row) return std::unexpected(row.error());
  return *row ? statement->integer(0) : 0;
}

Expected<std::string> Database::text(std::string_view sql) const {
  auto statement = prepare(sql);
  if (!statement) return std::unexpected(statement.error());
  const auto row = statement->step();
  if (!row) return std::unexpected(row.error());
  return *row ? statement->text(0) : std::string();
}

bool Database::read_only() const { return sqlite3_db_readonly(database_, "main") == 1; }

bool Database::in_transaction() const { return sqlite3_get_autocommit(database_) == 0; }

bool Database::moved() const {
  int moved = 0;
  return sqlite3_file_control(database_, "main", SQLITE_FCNTL_HAS_MOVED, &moved) == SQLITE_OK && moved != 0;
}

std::int64_t Database::changes() const { return sqlite3_changes64(database_); }

}  // namespace pons::bridge
