// For the journal's tests: files to break, and processes to kill.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>

#include "pons/bridge/journal/journal.hpp"
#include "pons/bridge/test_kit.hpp"

namespace pons::bridge {

namespace fs = std::filesystem;

inline task::Task sample(const std::string& id, int priority = 50) {
  return {.id = id, .priority = priority, .deadline = at(12.5), .steps = {{"pick", {{"object", id}}}}};
}

inline std::string bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

inline void execute(const fs::path& file, const char* sql) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(database, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
  sqlite3_close(database);
}

// Runs `work` in a process of its own, which then says so and waits to be killed.
inline void in_a_process_that_is_killed(const std::function<bool()>& work) {
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const char said = work() ? 'y' : 'n';
    if (::write(pipe_ends[1], &said, 1) == 1) ::pause();
    ::_exit(1);
  }
  ::close(pipe_ends[1]);
  char said = 0;
  EXPECT_EQ(::read(pipe_ends[0], &said, 1), 1);
  EXPECT_EQ(said, 'y');
  ::close(pipe_ends[0]);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

// Where the tests of any journal have theirs: a new one each time.
class Store {
 public:
  Store() = default;
  virtual ~Store() = default;
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;
  [[nodiscard]] virtual std::string place() const = 0;  // for Journal::open()
  // As somebody who goes round the journal. False: the tables themselves refuse it.
  [[nodiscard]] virtual bool execute(const std::string& sql) = 0;
  // SQL that makes it one of another version, and one whose event table may be changed.
  [[nodiscard]] virtual std::string another_version() const = 0;
  [[nodiscard]] virtual std::string unguarded() const = 0;
};
using MakeStore = std::unique_ptr<Store> (*)();

class FileStore final : public Store {
 public:
  [[nodiscard]] static std::unique_ptr<Store> make() { return std::make_unique<FileStore>(); }
  [[nodiscard]] std::string place() const override { return folder_ / "day.db"; }
  [[nodiscard]] bool execute(const std::string& sql) override {
    sqlite3* database = nullptr;
    EXPECT_EQ(sqlite3_open(place().c_str(), &database), SQLITE_OK);
    const int code = sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr);
    EXPECT_TRUE(code == SQLITE_OK || (code & 0xff) == SQLITE_CONSTRAINT) << sqlite3_errmsg(database);
    sqlite3_close(database);
    return code == SQLITE_OK;
  }
  [[nodiscard]] std::string another_version() const override { return "PRAGMA user_version = 99"; }
  [[nodiscard]] std::string unguarded() const override { return "DROP TRIGGER event_stays"; }

 private:
  TemporaryFolder folder_;
};

// What every journal does, wherever it lies. Instantiated where its stores are.
class AnyJournal : public testing::TestWithParam<MakeStore> {
 protected:
  [[nodiscard]] std::unique_ptr<Journal> open() const {
    auto journal = Journal::open(place());
    EXPECT_TRUE(journal) << journal.error().line();
    return std::move(*journal);
  }
  [[nodiscard]] std::string refusal() const {
    const auto journal = Journal::open(place());
    EXPECT_FALSE(journal);
    return journal ? "" : journal.error().line();
  }
  [[nodiscard]] std::string place() const { return store_->place(); }

  std::unique_ptr<Store> store_ = GetParam()();
};

class JournalTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<Journal> open() const {
    auto journal = Journal::open(file_);
    EXPECT_TRUE(journal) << journal.error().line();
    return std::move(*journal);
  }
  // Opens `file`, which must fail, and gives the line a person reads.
  [[nodiscard]] static std::string refusal(const fs::path& file) {
    const auto journal = Journal::open(file);
    EXPECT_FALSE(journal);
    return journal ? "" : journal.error().line();
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_ / "day.db";
};

}  // namespace pons::bridge
