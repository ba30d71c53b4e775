// Recording: how many small messages a second, and how many bytes of large ones, go into an MCAP file in memory
// (tmpfs), so that no disk is measured: by the writer alone, and through the recorder's queue with a thread on either
// side. The same bytes as rows of an SQLite table in WAL mode, turn by turn, are what they are held against.

#include <fmt/format.h>
#include <sqlite3.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "pons/record/mcap_reader.hpp"
#include "pons/record/recorder.hpp"

namespace {

using namespace pons;
namespace fs = std::filesystem;

constexpr double kBarMessages = 300;  // thousands a second, of 100 bytes
constexpr double kBarBytes = 1;       // GB/s, of 10 KiB

[[noreturn]] void give_up(const std::string& why) {
  fmt::print(stderr, "recording: {}\n", why);
  std::exit(2);
}

template <typename T>
T expect(Expected<T> value) {
  if (!value) give_up(value.error().line());
  if constexpr (!std::is_void_v<T>) return std::move(*value);
}

struct Load {
  std::size_t size = 0;  // of a message
  std::uint64_t count = 0;
};

// Not all alike, so that SQLite has nothing to gain from equal pages.
std::string pattern(std::size_t size) {
  std::string data(size, ' ');
  for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<char>(i * 2654435761U >> 13U);
  return data;
}

std::span<const std::byte> bytes_of(const std::string& data) { return std::as_bytes(std::span(data)); }

// A thousand a second, as of a control loop.
record::mcap::Timestamp log_time(std::uint64_t i) { return 1'000'000 * i; }

double seconds(const std::function<void()>& work) {
  const auto begun = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// That what was measured was done.
void expect_count(const fs::path& file, std::uint64_t count) {
  const auto reader = expect(record::McapReader::open(file));
  if (!reader->contents().finished || reader->contents().statistics.messages != count)
    give_up(fmt::format("{} holds {} messages, not {}", file.string(), reader->contents().statistics.messages, count));
}

double by_writer(const fs::path& folder, const Load& load) {
  const fs::path file = folder / "writer.mcap";
  const std::string data = pattern(load.size);
  const double took = seconds([&] {
    auto writer = expect(record::McapWriter::create(file, {.chunk_span = std::chrono::hours(1)}));
    const auto channel = expect(writer->add_channel(0, "/load", "cdr", {}));
    for (std::uint64_t i = 0; i < load.count; ++i)
      expect(writer->write({channel, static_cast<std::uint32_t>(i), log_time(i), log_time(i), bytes_of(data)}));
    expect(writer->finish());
  });
  expect_count(file, load.count);
  fs::remove(file);
  return took;
}

double by_recorder(const fs::path& folder, const Load& load) {
  const std::string data = pattern(load.size);
  record::RecorderOptions options;
  options.folder = folder;
  options.name = "recorder";
  options.file_bytes = std::uint64_t{1} << 40U;
  options.writer.chunk_span = std::chrono::hours(1);
  auto recorder = expect(record::Recorder::open(options));
  const auto topic = recorder->add_topic({"/load", "", "", "", "cdr", {}});
  const double took = seconds([&] {
    std::jthread writing([&] { recorder->work(); });
    for (std::uint64_t i = 0; i < load.count; ++i) {
      // Faster than it can be written is not what is measured.
      while (!recorder->record(topic, log_time(i), log_time(i), bytes_of(data))) std::this_thread::yield();
    }
    recorder->close();
  });
  expect_count(folder / "recorder_0.mcap", load.count);
  fs::remove(folder / "recorder_0.mcap");
  return took;
}

// A table as rosbag2's has it; a thousand rows a transaction, and its writer's setting that survives a process's death.
double by_sqlite(const fs::path& folder, const Load& load) {
  const fs::path file = folder / "sqlite.db";
  const std::string data = pattern(load.size);
  sqlite3* database = nullptr;
  const auto run = [&](const char* sql) {
    if (sqlite3_exec(database, sql, nullptr, nullptr, nullptr) != SQLITE_OK) give_up(sqlite3_errmsg(database));
  };
  const double took = seconds([&] {
    if (sqlite3_open(file.c_str(), &database) != SQLITE_OK) give_up("cannot open " + file.string());
    run("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
        "BLOB NOT "
        "NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
    sqlite3_stmt* insert = nullptr;
    const char* sql = "INSERT INTO messages(topic_id, timestamp, data) VALUES(?1, ?2, ?3)";
    if (sqlite3_prepare_v2(database, sql, -1, &insert, nullptr) != SQLITE_OK) give_up(sqlite3_errmsg(database));
    for (std::uint64_t i = 0; i < load.count; ++i) {
      if (i % 1000 == 0) run("BEGIN");
      sqlite3_bind_int64(insert, 1, 1);
      sqlite3_bind_int64(insert, 2, static_cast<sqlite3_int64>(log_time(i)));
      sqlite3_bind_blob(insert, 3, data.data(), static_cast<int>(data.size()), SQLITE_STATIC);
      if (sqlite3_step(insert) != SQLITE_DONE) give_up(sqlite3_errmsg(database));
      sqlite3_reset(insert);
      if (i % 1000 == 999 || i + 1 == load.count) run("COMMIT");
    }
    sqlite3_finalize(insert);
    sqlite3_close(database);
  });
  for (const char* ending : {"", "-wal", "-shm"}) fs::remove(file.string() + ending);
  return took;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

struct Taken {
  double writer = 0, recorder = 0, sqlite = 0;  // seconds, medians
};

Taken measure(const fs::path& folder, const Load& load, int rounds) {
  std::vector<double> writer, recorder, sqlite;
  for (int round = 0; round < rounds; ++round) {
    writer.push_back(by_writer(folder, load));
    sqlite.push_back(by_sqlite(folder, load));
    recorder.push_back(by_recorder(folder, load));
  }
  return {median(writer), median(recorder), median(sqlite)};
}

struct Options {
  bool gate = false;
  int rounds = 5;
  double share = 1;
  fs::path folder = "/dev/shm";
};

int run(const Options& options) {
  std::string name = (options.folder / "pons_recording_XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) give_up("cannot make a folder in " + options.folder.string());
  const Load small{100, static_cast<std::uint64_t>(2e6 * options.share)};
  const Load large{10240, static_cast<std::uint64_t>(1e5 * options.share)};
  const Taken of_small = measure(name, small, options.rounds), of_large = measure(name, large, options.rounds);
  fs::remove_all(name);
  const auto messages = [&](double took) { return 1e-3 * static_cast<double>(small.count) / took; };
  const auto bytes = [&](double took) { return 1e-9 * static_cast<double>(large.count * large.size) / took; };
  fmt::print(
      "{} messages of 100 B, thousands a second: writer {:.0f}, through the queue {:.0f}, SQLite {:.0f}; ratio "
      "{:.1f}\n",
      small.count, messages(of_small.writer), messages(of_small.recorder), messages(of_small.sqlite),
      of_small.sqlite / of_small.recorder);
  fmt::print("{} messages of 10 KiB, GB/s: writer {:.2f}, through the queue {:.2f}, SQLite {:.2f}; ratio {:.1f}\n",
             large.count, bytes(of_large.writer), bytes(of_large.recorder), bytes(of_large.sqlite),
             of_large.sqlite / of_large.recorder);
  const bool kept = messages(of_small.recorder) >= kBarMessages && bytes(of_large.recorder) >= kBarBytes;
  if (!options.gate || kept) return 0;
  fmt::print(stderr, "recording: below {:.0f} thousand messages a second or {:.1f} GB/s\n", kBarMessages, kBarBytes);
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Options options;
    CLI::App app("Messages and bytes a second into a recording in memory, beside SQLite");
    app.add_option("--rounds", options.rounds, "Rounds; figures are their medians")->check(CLI::PositiveNumber);
    app.add_option("--share", options.share, "Of the messages that are written otherwise")->check(CLI::PositiveNumber);
    app.add_option("--folder", options.folder, "On a tmpfs (/dev/shm)")->check(CLI::ExistingDirectory);
    app.add_flag("--gate", options.gate, "Exit code 1 where a bar is missed");
    CLI11_PARSE(app, argc, argv);
    return run(options);
  } catch (const std::exception& error) {
    fmt::print(stderr, "recording: {}\n", error.what());
    return 2;
  }
}
