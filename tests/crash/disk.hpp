// A disk that loses its power: an SQLite VFS in memory. What was written and not synced may be gone afterwards, wholly
// or in part, sector by sector in any order; so may files that were made or removed since their folder was synced.
//
// Models what POSIX promises and SQLite counts on: a sync makes a file's bytes durable, the first sync of a new log its
// folder; a sector is written wholly or not at all.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "pons/core/random.hpp"

namespace pons::tests {

class Disk {
 public:
  // A disk that lies says that it has synced.
  enum class Syncs : std::uint8_t { kTruly, kNever };

  Disk(std::uint64_t seed, Syncs syncs);
  ~Disk();
  Disk(const Disk&) = delete;
  Disk& operator=(const Disk&) = delete;

  // For Journal::open().
  [[nodiscard]] const char* vfs() const { return name_.c_str(); }

  // Writes, cuts, syncs and removals so far.
  [[nodiscard]] std::int64_t operations() const { return operations_; }
  // With the n-th from now on (the first is 1) the power goes: that one may still have happened, and all later calls
  // fail.
  void power_off_at(std::int64_t n) { off_at_ = operations_ + n; }
  [[nodiscard]] bool off() const { return off_; }
  // What a file holds, empty where there is none; and a file as a disk may hold it.
  [[nodiscard]] std::string content(const std::string& name) const;
  void put(const std::string& name, std::string content);
  // What a computer finds that is switched on again. Nothing may have a file open.
  void restart();

 private:
  friend struct DiskCalls;
  struct Change {
    std::size_t offset = 0;
    std::string bytes;
    std::optional<std::size_t> cut_to;
  };
  struct File {
    std::string now, durable;
    std::vector<Change> pending;  // since the last sync
    bool folder_synced = false;   // since it was made
  };

  [[nodiscard]] bool spend();  // one operation; false: with it the power went
  void write(File& file, Change change);
  void sync(File& file);
  void remove(const std::string& name);
  [[nodiscard]] std::string after_power_off(const File& file);
  static void apply(std::string& content, const Change& change);

  std::string name_;
  sqlite3_vfs vfs_{};
  Random random_;
  Syncs syncs_;
  std::map<std::string, File> files_;    // that are there
  std::map<std::string, File> removed_;  // and may be there again
  std::set<std::string> named_;          // that the folder keeps
  std::int64_t operations_ = 0;
  std::optional<std::int64_t> off_at_;
  std::int64_t unnamed_ = 0;
  bool off_ = false;
};

}  // namespace pons::tests
