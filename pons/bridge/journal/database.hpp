// The little of a database that a journal needs, with errors as values. SQL is what SQLite and PostgreSQL both take;
// where they differ, layout.cpp has both.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "pons/core/error.hpp"

namespace pons::bridge {

// A prepared statement, whose parameters are ?1, ?2, … Bind in order, step until false, then reset before the next use.
class Statement {
 public:
  // What each kind of database does for one.
  class Driver {
   public:
    Driver() = default;
    virtual ~Driver() = default;
    Driver(const Driver&) = delete;
    Driver& operator=(const Driver&) = delete;
    virtual void bind(int parameter, std::int64_t value) = 0;
    virtual void bind(int parameter, std::string_view value) = 0;  // copied
    [[nodiscard]] virtual Expected<bool> step() = 0;
    virtual void reset() = 0;
    [[nodiscard]] virtual std::int64_t integer(int column) const = 0;
    [[nodiscard]] virtual std::string text(int column) const = 0;  // empty where it is null
    [[nodiscard]] virtual bool is_null(int column) const = 0;
  };

  Statement() = default;
  explicit Statement(std::unique_ptr<Driver> driver) : driver_(std::move(driver)) {}

  Statement& bind(std::int64_t value) {
    driver_->bind(++bound_, value);
    return *this;
  }
  Statement& bind(std::string_view value) {
    driver_->bind(++bound_, value);
    return *this;
  }
  // True: a row is there to read.
  [[nodiscard]] Expected<bool> step() { return driver_->step(); }
  // Steps to the end and resets; rows are thrown away.
  [[nodiscard]] Expected<void> run();
  // Likewise; the first column of the first row, 0 when there was none.
  [[nodiscard]] Expected<std::int64_t> run_for_integer();
  void reset() {
    driver_->reset();
    bound_ = 0;
  }

  [[nodiscard]] std::int64_t integer(int column) const { return driver_->integer(column); }
  [[nodiscard]] std::string text(int column) const { return driver_->text(column); }
  [[nodiscard]] bool is_null(int column) const { return driver_->is_null(column); }

 private:
  std::unique_ptr<Driver> driver_;
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

enum class Dialect : std::uint8_t { kSqlite, kPostgres };
enum class Mode : std::uint8_t {
  kOwn,   // writes, and nobody else does
  kRead,  // writes nothing
  kTurn,  // writes in turn with others (PostgreSQL only)
};

// One connection, of one thread. Statements must not outlive it.
class Database {
 public:
  Database() = default;
  virtual ~Database() = default;
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  [[nodiscard]] virtual Dialect dialect() const = 0;
  // For people: without a password.
  [[nodiscard]] const std::string& shown() const { return shown_; }
  // The PostgreSQL schema of whoever owns it, and the name that this one has among bridges; empty for a file.
  [[nodiscard]] const std::string& schema() const { return schema_; }
  [[nodiscard]] const std::string& name() const { return name_; }

  [[nodiscard]] virtual Expected<Statement> prepare(std::string_view sql) = 0;
  // Statements without parameters; rows are thrown away.
  [[nodiscard]] virtual Expected<void> execute(const std::string& sql) = 0;
  // The first column of the first row.
  [[nodiscard]] Expected<std::int64_t> integer(std::string_view sql);
  [[nodiscard]] Expected<std::string> text(std::string_view sql);
  // Wholly or, after an error, not at all.
  [[nodiscard]] Expected<void> in_one_transaction(const std::string& script);

  [[nodiscard]] virtual bool in_transaction() const = 0;
  [[nodiscard]] virtual std::int64_t changes() const = 0;  // rows of the last statement
  // The number of the row that the last INSERT has added, which PostgreSQL wants to be asked for by RETURNING; 0: none.
  [[nodiscard]] virtual std::int64_t inserted() const = 0;
  // Of the owner, once the tables are there: from now on what was committed is durable. Error: it would not be.
  [[nodiscard]] virtual Expected<void> promise_durability() = 0;
  // Journal::room().
  [[nodiscard]] virtual std::optional<std::uint64_t> room() const { return std::nullopt; }
  // Before a commit. Error: what it would write nobody would find again.
  [[nodiscard]] virtual Expected<void> still_there() = 0;

 protected:
  std::string shown_, schema_, name_;
};

}  // namespace pons::bridge
