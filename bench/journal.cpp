// Durable hand-offs: how many tasks a second a journal takes so that they survive the loss of power, against bare
// SQLite that writes the same text into one table, with the same settings, on the same disk, turn by turn.

#include <fmt/format.h>
#include <sqlite3.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"

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
double ours(const fs::path& file, int count, int together) {
  auto journal = bridge::Journal::open(file);
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

double bare(const fs::path& file, int count, int together) {
  sqlite3* database = nullptr;
  const auto run = [&](const char* sql) {
    if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) != SQLITE_OK) give_up(sqlite3_errmsg(database));
  };
  if (sqlite3_open(file.c_str(), &database) != SQLITE_OK) give_up("cannot open " + file.string());
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

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

// The median of the rounds' ratios.
double compare(const fs::path& folder, int count, int together, int rounds) {
  std::vector<double> mine, theirs, ratios;
  for (int round = 0; round < rounds; ++round) {
    const auto measure = [&](double (*rate)(const fs::path&, int, int), const char* name) {
      return rate(folder / fmt::format("{}-{}-{}.db", name, together, round), count, together);
    };
    // Who goes first, has the disk as the other left it.
    if (round % 2 == 0) mine.push_back(measure(ours, "ours"));
    theirs.push_back(measure(bare, "bare"));
    if (round % 2 == 1) mine.push_back(measure(ours, "ours"));
    ratios.push_back(mine.back() / theirs.back());
  }
  const double ratio = median(ratios);
  fmt::print("{:>3} a commit: {:>7.0f} durable hand-offs a second, bare SQLite {:>7.0f}; ratio {:.2f}\n", together,
             median(mine), median(theirs), ratio);
  return ratio;
}

struct Options {
  int count = 1000, rounds = 5;
  bool gate = false;
  std::string folder = ".";
};

int run(const Options& options) {
  std::string own = (fs::path(options.folder) / "journal-bench-XXXXXX").string();
  if (::mkdtemp(own.data()) == nullptr) give_up("cannot make a folder in " + options.folder);
  const double alone = compare(own, options.count, 1, options.rounds);
  // Where both wait for the disk less, and ours makes JSON of tasks.
  (void)compare(own, options.count * 10, 20, options.rounds);
  fs::remove_all(own);
  if (!options.gate || alone >= kBar) return 0;
  fmt::print(stderr, "journal: below {:.1f} of bare SQLite\n", kBar);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("Durable hand-offs a second over those of bare SQLite");
    app.add_option("--count", options.count, "Hand-offs a round")->check(CLI::PositiveNumber);
    app.add_option("--rounds", options.rounds, "Rounds; figures are their medians")->check(CLI::PositiveNumber);
    app.add_option("--folder", options.folder, "On the disk to be measured (here)");
    app.add_flag("--gate", options.gate, "Exit code 1 below 0.8 of bare SQLite");
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "journal: {}\n", error.what());
    return 2;
  }
}
