// The little of SQLite that the journal needs, with errors as values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace pons::bridge {

// A prepared statement. Bind in order, step until false, then reset before the next use.
class Statement {
 public:
  Statement() = default;
  Statement(Statement&& other) noexcept;
  Statement& operator=(Statement&& other) noexcept;
  ~Statement();

  Statement& bind(std::int64_t value);
  Statement& bind(std::string_view value);  // copied
  Statement& bind_null();
  // True: a row is there to read.
  [[nodiscard]] Expected<bool> step();
  // For what returns no rows: steps to the end and resets.
  [[nodiscard]] Expected<void> run();
  void reset();

  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] bool is_null(int column) const;

 private:
  friend class Database;
  sqlite3_stmt* statement_ = nullptr;
  std::string file_;
  int bound_ = 0;
};

// Resets a statement when the reading of its rows is over, however it ends: an unfinished one holds a lock.
class Reading {
 public:
  explicit Reading(Statement& statement) : statement_(statement) {}
  ~Reading() { statement_.reset(); }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

 private:
  Statement& statement_;
};

// One connection. Waits for no lock.
class Database {
 public:
  enum class Mode : std::uint8_t { kCreate, kRead };

  Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;
  ~Database();

  // `vfs` by its name; none is the operating system's.
  [[nodiscard]] Expected<void> open(const std::string& file, Mode mode, const char* vfs = nullptr);
  [[nodiscard]] Expected<Statement> prepare(std::string_view sql) const;
  // Statements without parameters; rows are thrown away.
  [[nodiscard]] Expected<void> execute(const char* sql) const;
  // The first column of the first row.
  [[nodiscard]] Expected<std::int64_t> integer(std::string_view sql) const;
  [[nodiscard]] Expected<std::string> text(std::string_view sql) const;

  [[nodiscard]] bool read_only() const;
  [[nodiscard]] bool in_transaction() const;
  // Whether the file that is open no longer lies where it did.
  [[nodiscard]] bool moved() const;
  [[nodiscard]] std::int64_t changes() const;  // rows of the last statement

 private:
  sqlite3* database_ = nullptr;
  std::string file_;
};

}  // namespace pons::bridge
