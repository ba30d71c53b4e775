#include "pons/bridge/journal/sqlite.hpp"

#include <fmt/format.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
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

std::unexpected<Error> no_journal(const std::string& file) {
  return fail("this file is not a journal", file, "name another file, or move this one away");
}

// One clear line for each way a file can be wrong.
std::unexpected<Error> failure(sqlite3* database, const std::string& file) {
  const int code = sqlite3_errcode(database);
  switch (code & 0xff) {
    case SQLITE_NOTADB:
    case SQLITE_FORMAT:
      return no_journal(file);
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

std::uint64_t size_of(const std::string& file) {
  std::error_code none;
  const std::uint64_t size = std::filesystem::file_size(file, none);
  return none ? 0 : size;
}

// SQLite takes a file that has lost its end for a whole one as long as it asks for nothing of that, and one of less
// than a header for a new one. Not where a log or a rollback journal is to complete it.
Expected<void> check_length(const std::string& named) {
  constexpr std::string_view kMagic = "SQLite format 3";  // and a zero
  constexpr std::size_t kHeader = 100;
  std::error_code none;
  const std::string real = std::filesystem::canonical(named, none).string();  // where the log lies, too
  const std::string& file = none ? named : real;
  const std::uint64_t size = size_of(file), log = size_of(file + "-wal");
  if (size == 0 && log == 0) return {};
  if (size_of(file + "-journal") > 0 || (size >= kHeader && log > 0)) return {};
  std::string header(std::min<std::uint64_t>(size, kHeader), '\0');
  std::ifstream(file, std::ios::binary).read(header.data(), static_cast<std::streamsize>(header.size()));
  const std::size_t shared = std::min(header.size(), kMagic.size());
  if (header.substr(0, shared) != kMagic.substr(0, shared)) return no_journal(named);
  const auto number = [&](std::size_t at, int bytes) {
    std::uint64_t value = 0;
    for (int i = 0; i < bytes; ++i)
      value = value << 8U | static_cast<std::uint8_t>(header[at + static_cast<std::size_t>(i)]);
    return value;
  };
  std::uint64_t whole = kHeader;
  if (size >= kHeader) {
    const std::uint64_t page = number(16, 2) == 1 ? 65536 : number(16, 2);
    const bool valid = number(24, 4) == number(92, 4);  // else an old SQLite wrote the number of pages
    whole = valid ? page * number(28, 4) : 0;
  }
  if (size >= whole) return {};
  return fail(fmt::format("the journal has lost its end: {} of at least {} bytes are there", size, whole), named,
              "restore a copy, or name another file");
}

class SqliteStatement final : public Statement::Driver {
 public:
  SqliteStatement(sqlite3_stmt* statement, const std::string& file) : statement_(statement), file_(file) {}
  ~SqliteStatement() override { sqlite3_finalize(statement_); }

  void bind(int parameter, std::int64_t value) override {
    [[maybe_unused]] const int code = sqlite3_bind_int64(statement_, parameter, value);
    assert(code == SQLITE_OK);
  }
  void bind(int parameter, std::string_view value) override {
    // A null pointer would bind NULL.
    const char* data = value.empty() ? "" : value.data();
    [[maybe_unused]] const int code =
        sqlite3_bind_text64(statement_, parameter, data, value.size(), SQLITE_TRANSIENT, SQLITE_UTF8);
    assert(code == SQLITE_OK);
  }
  Expected<bool> step() override {
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    return failure(sqlite3_db_handle(statement_), file_);
  }
  void reset() override {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  [[nodiscard]] std::int64_t integer(int column) const override { return sqlite3_column_int64(statement_, column); }
  [[nodiscard]] std::string text(int column) const override {
    const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return data == nullptr ? std::string()
                           : std::string(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)));
  }
  [[nodiscard]] bool is_null(int column) const override {
    return sqlite3_column_type(statement_, column) == SQLITE_NULL;
  }

 private:
  sqlite3_stmt* statement_;
  const std::string& file_;  // the database's
};

class SqliteDatabase final : public Database {
 public:
  ~SqliteDatabase() override { sqlite3_close(database_); }

  Expected<void> open(const std::string& file, Mode mode, const char* vfs) {
    shown_ = file;
    on_disk_ = file != ":memory:" && vfs == nullptr;
    const bool create = mode == Mode::kOwn;
    const int flags = SQLITE_OPEN_NOMUTEX |
                      (create ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
    const std::string name = create ? file : reading_uri(file);
    if (sqlite3_open_v2(name.c_str(), &database_, flags, vfs) != SQLITE_OK) return failure(database_, shown_);
    // The lock is kept from the first access to the end: one owner, and no index in shared memory.
    return create ? execute("PRAGMA locking_mode=EXCLUSIVE;PRAGMA synchronous=FULL") : Expected<void>{};
  }

  [[nodiscard]] Dialect dialect() const override { return Dialect::kSqlite; }

  Expected<Statement> prepare(std::string_view sql) override {
    sqlite3_stmt* statement = nullptr;
    const int code = sqlite3_prepare_v2(database_, sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
    if (code != SQLITE_OK) return failure(database_, shown_);
    return Statement(std::make_unique<SqliteStatement>(statement, shown_));
  }

  Expected<void> execute(const std::string& sql) override {
    if (sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) return failure(database_, shown_);
    return {};
  }

  [[nodiscard]] bool in_transaction() const override { return sqlite3_get_autocommit(database_) == 0; }
  [[nodiscard]] std::int64_t changes() const override { return sqlite3_changes64(database_); }
  [[nodiscard]] std::int64_t inserted() const override {
    return changes() == 1 ? sqlite3_last_insert_rowid(database_) : 0;
  }

  // A new file is created in rollback mode, so that its identity stands in the file itself and not only in the log.
  Expected<void> promise_durability() override {
    const auto log = text("PRAGMA journal_mode=WAL");
    if (!log) return std::unexpected(log.error());
    if (*log != (shown_ == ":memory:" ? "memory" : "wal"))
      return fail("this disk takes no write-ahead log", shown_, "name a file on a local disk");
    return execute("PRAGMA synchronous=FULL;PRAGMA foreign_keys=ON");
  }

  // The log would go on into a file that no name leads to any more, or be one itself.
  Expected<void> still_there() override {
    int moved = 0;
    const int code = sqlite3_file_control(database_, "main", SQLITE_FCNTL_HAS_MOVED, &moved);
    if (code == SQLITE_OK && moved != 0)
      return fail("the journal's file is gone", shown_, "put it back where it was, and start again");
    if (!on_disk_) return {};
    struct stat there{};
    const bool is_there = ::stat(log_name().c_str(), &there) == 0;
    if (!log_ && is_there) log_ = there.st_ino;  // it is made by what is written first
    if (!log_ || (is_there && there.st_ino == *log_)) return {};
    // What was told is written into the file when it is closed.
    return fail("the journal's log is gone", log_name(), "keep others from the files beside a journal; start again");
  }

  // Both grow: the file, and the log beside it that goes into the file from time to time.
  [[nodiscard]] std::optional<std::uint64_t> room() const override {
    if (!on_disk_) return std::nullopt;
    std::error_code unknown;
    const std::filesystem::path file(shown_);
    const auto folder = file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
    const std::filesystem::space_info space = std::filesystem::space(folder, unknown);
    if (unknown) return std::nullopt;
    rlimit most{};
    if (getrlimit(RLIMIT_FSIZE, &most) != 0 || most.rlim_cur == RLIM_INFINITY) return space.available;
    std::uint64_t large = 0;
    for (const char* const beside : {"", "-wal"}) large = std::max(large, size_of(shown_ + beside));
    return std::min<std::uint64_t>(space.available, most.rlim_cur > large ? most.rlim_cur - large : 0);
  }

  [[nodiscard]] bool read_only() const { return sqlite3_db_readonly(database_, "main") == 1; }

 private:
  // Beside the file itself, not beside a link to it.
  [[nodiscard]] std::string log_name() const { return sqlite3_filename_wal(sqlite3_db_filename(database_, "main")); }

  sqlite3* database_ = nullptr;
  bool on_disk_ = false;  // the operating system's
  std::optional<ino_t> log_;
};

}  // namespace

Expected<std::unique_ptr<Database>> open_sqlite(const std::string& file, Mode mode, const char* vfs) {
  std::error_code ignored;
  if (mode == Mode::kRead && !std::filesystem::exists(file, ignored))
    return fail("there is no such journal", file, "name the file that a run was given with --journal");
  if (file != ":memory:") {
    if (auto place = check_place(file); !place) return std::unexpected(place.error());
    if (vfs == nullptr) {
      if (auto whole = check_length(file); !whole) return std::unexpected(whole.error());
    }
  }
  auto database = std::make_unique<SqliteDatabase>();
  if (auto opened = database->open(file, mode, vfs); !opened) return std::unexpected(opened.error());
  return database;
}

}  // namespace pons::bridge
