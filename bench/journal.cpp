// Durable hand-offs: how many tasks a second a journal takes so that they survive the loss of power, against bare
// SQLite that writes the same text into one table, with the same settings, on the same disk, turn by turn. With
// --postgres the same on a server of the benchmark's own, against bare libpq.

#include <fmt/format.h>
#include <libpq-fe.h>
#include <sqlite3.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "tests/postgres/server.hpp"

namespace {

using namespace pons;
namespace fs = std::filesystem;

constexpr double kBar = 0.8;

task::Task sample(int number) {
  const std::string id = fmt::format("P{:06}", number);
  return {.id = id,
          .order = id,
          .priority = 50,
          .deadline = Time(std::chrono::seconds(1000)),
          .steps = {{"pick", {{"object", id}}}, {"place", {{"object", id}, {"place", "chute_3"}}}}};
}

[[noreturn]] void give_up(const std::string& why) {
  fmt::print(stderr, "journal: {}\n", why);
  std::exit(2);
}

double per_second(int count, const std::function<void()>& work) {
  const auto begun = std::chrono::steady_clock::now();
  work();
  return count / std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// `together` tasks a commit.
double ours(const std::string& place, int count, int together) {
  auto journal = bridge::Journal::open(place);
  if (!journal) give_up(journal.error().line());
  std::vector<task::Task> tasks;
  for (int i = 0; i < count; ++i) tasks.push_back(sample(i));
  return per_second(count, [&] {
    for (int i = 0; i < count; ++i) {
      if (auto taken = (*journal)->accept(tasks[static_cast<std::size_t>(i)], Time{}); !taken)
        give_up(taken.error().line());
      if ((i + 1) % together > 0 && i + 1 < count) continue;
      if (auto durable = (*journal)->commit(); !durable) give_up(durable.error().line());
    }
  });
}

double bare_sqlite(const std::string& file, int count, int together) {
  sqlite3* database = nullptr;
  const auto run = [&](const char* sql) {
    if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) != SQLITE_OK) give_up(sqlite3_errmsg(database));
  };
  if (sqlite3_open(file.c_str(), &database) != SQLITE_OK) give_up("cannot open " + file);
  run("PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
      "CREATE TABLE task(id TEXT PRIMARY KEY, body TEXT NOT NULL) STRICT;");
  sqlite3_stmt* insert = nullptr;
  if (sqlite3_prepare_v2(database, "INSERT INTO task VALUES(?1, ?2)", -1, &insert, nullptr) != SQLITE_OK)
    give_up(sqlite3_errmsg(database));
  std::vector<std::pair<std::string, std::string>> rows;
  for (int i = 0; i < count; ++i) rows.emplace_back(sample(i).id, task::to_json(sample(i)).dump());
  const double rate = per_second(count, [&] {
    for (int i = 0; i < count; ++i) {
      if (i % together == 0) run("BEGIN IMMEDIATE");
      const auto& [id, body] = rows[static_cast<std::size_t>(i)];
      sqlite3_bind_text(insert, 1, id.c_str(), -1, SQLITE_STATIC);
      sqlite3_bind_text(insert, 2, body.c_str(), -1, SQLITE_STATIC);
      if (sqlite3_step(insert) != SQLITE_DONE) give_up(sqlite3_errmsg(database));
      sqlite3_reset(insert);
      if ((i + 1) % together == 0 || i + 1 == count) run("COMMIT");
    }
  });
  sqlite3_finalize(insert);
  sqlite3_close(database);
  return rate;
}

double bare_libpq(const std::string& place, int count, int together) {
  PGconn* connection = PQconnectdb(place.c_str());
  const auto expect = [&](PGresult* result) {
    const ExecStatusType status = PQresultStatus(result);
    if (status != PGRES_COMMAND_OK) give_up(PQerrorMessage(connection));
    PQclear(result);
  };
  const auto run = [&](const char* sql) { expect(PQexec(connection, sql)); };
  run("SET synchronous_commit = on");
  run("CREATE TABLE task(id TEXT PRIMARY KEY, body TEXT NOT NULL)");
  expect(PQprepare(connection, "insert", "INSERT INTO task VALUES($1, $2)", 0, nullptr));
  std::vector<std::pair<std::string, std::string>> rows;
  for (int i = 0; i < count; ++i) rows.emplace_back(sample(i).id, task::to_json(sample(i)).dump());
  const double rate = per_second(count, [&] {
    for (int i = 0; i < count; ++i) {
      if (i % together == 0) run("BEGIN");
      const auto& [id, body] = rows[static_cast<std::size_t>(i)];
      const std::array<const char*, 2> values{id.c_str(), body.c_str()};
      expect(PQexecPrepared(connection, "insert", 2, values.data(), nullptr, nullptr, 0));
      if ((i + 1) % together == 0 || i + 1 == count) run("COMMIT");
    }
  });
  PQfinish(connection);
  return rate;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

// The other to be measured, and a new place for one or the other each time.
struct Bare {
  const char* name;
  double (*rate)(const std::string& place, int count, int together);
  std::function<std::string()> place_of_ours, place_of_bare;
};

// The median of the rounds' ratios.
double compare(const Bare& bare, int count, int together, int rounds) {
  std::vector<double> mine, theirs, ratios;
  for (int round = 0; round < rounds; ++round) {
    const auto measure = [&] { mine.push_back(ours(bare.place_of_ours(), count, together)); };
    // Who goes first, has the disk as the other left it.
    if (round % 2 == 0) measure();
    theirs.push_back(bare.rate(bare.place_of_bare(), count, together));
    if (round % 2 == 1) measure();
    ratios.push_back(mine.back() / theirs.back());
  }
  const double ratio = median(ratios);
  fmt::print("{:>3} a commit: {:>7.0f} durable hand-offs a second, bare {} {:>7.0f}; ratio {:.2f}\n", together,
             median(mine), bare.name, median(theirs), ratio);
  return ratio;
}

// One a commit, and many.
double compare(const Bare& bare, int count, int rounds) {
  const double alone = compare(bare, count, 1, rounds);
  // Where both wait for the disk less, and ours makes JSON of tasks.
  (void)compare(bare, count * 10, 20, rounds);
  return alone;
}

struct Options {
  int count = 1000, rounds = 5;
  bool gate = false, postgres = false;
  std::string folder = ".";
};

double on_files(const Options& options) {
  std::string own = (fs::path(options.folder) / "journal-bench-XXXXXX").string();
  if (::mkdtemp(own.data()) == nullptr) give_up("cannot make a folder in " + options.folder);
  int files = 0;
  const auto place = [&] { return (fs::path(own) / fmt::format("{}.db", ++files)).string(); };
  const double alone = compare({"SQLite", bare_sqlite, place, place}, options.count, options.rounds);
  fs::remove_all(own);
  return alone;
}

double on_postgres(const Options& options) {
  tests::PostgresServer server(fs::absolute(options.folder));
  const auto ours = [&] { return server.place(server.make_database(), "bench"); };
  const auto bare = [&] { return server.place(server.make_database()); };
  return compare({"libpq", bare_libpq, ours, bare}, options.count, options.rounds);
}

int run(const Options& options) {
  const double alone = options.postgres ? on_postgres(options) : on_files(options);
  if (!options.gate || alone >= kBar) return 0;
  fmt::print(stderr, "journal: below {:.1f} of the bare database\n", kBar);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("Durable hand-offs a second over those of the bare database");
    app.add_option("--count", options.count, "Hand-offs a round")->check(CLI::PositiveNumber);
    app.add_option("--rounds", options.rounds, "Rounds; figures are their medians")->check(CLI::PositiveNumber);
    app.add_option("--folder", options.folder, "On the disk to be measured (here)");
    app.add_flag("--gate", options.gate, "Exit code 1 below 0.8 of the bare database");
    app.add_flag("--postgres", options.postgres, "On PostgreSQL");
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "journal: {}\n", error.what());
    return 2;
  }
}
