// A disk that loses its power: an SQLite VFS in memory. What was written and not synced may be gone afterwards, wholly
// or in part, sector by sector in any order, a sector itself down to any byte; so may files that were made or removed
// since their folder was synced.
//
// Models what POSIX promises and SQLite counts on: a sync makes a file's bytes durable, the first sync of a new log its
// folder; what a write does not touch stays as it was.
//
// A process that dies takes nothing with it: what it has written the next one finds, synced or not.
#pragma once

#include <sqlite3.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/random.hpp"

namespace pons::tests {

class Disk {
 public:
  enum class Operation : std::uint8_t { kWrite, kCut, kSync, kRemove };
  enum class Moment : std::uint8_t { kBefore, kAfter };
  // Asked before and after each operation, with the file's name. False: who uses the disk dies there, and all later
  // calls fail.
  using Watch = std::function<bool(Operation operation, Moment moment, const std::string& file)>;

  // What became of the sectors that were written and not synced when the power went.
  struct Losses {
    std::size_t lost = 0, torn = 0;
  };

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
  [[nodiscard]] const Losses& losses() const { return losses_; }
  // With the n-th from now on (the first is 1) the power goes: that one may still have happened, and all later calls
  // fail.
  void power_off_at(std::int64_t n) { off_at_ = operations_ + n; }
  [[nodiscard]] bool off() const { return off_; }
  void watch(Watch watch) { watch_ = std::move(watch); }
  // Its user is dead: all calls fail until the next one comes.
  void user_dies() { off_ = true; }
  // What a file holds, empty where there is none; and a file as a disk may hold it.
  [[nodiscard]] std::string content(const std::string& name) const;
  void put(const std::string& name, std::string content);
  // What a computer finds that is switched on again. Nothing may have a file open.
  void restart();
  // What the next process finds on the same computer. Likewise.
  void next_user();

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

  [[nodiscard]] bool asks(Operation operation, Moment moment, const std::string& file);
  [[nodiscard]] bool spend();                                              // counts one; false: with it the power goes
  [[nodiscard]] bool begin(Operation operation, const std::string& file);  // false: nothing of it happens
  // It has happened; false: with it the power went.
  [[nodiscard]] bool end(Operation operation, const std::string& file);
  void write(File& file, Change change);
  void sync(File& file);
  void remove(const std::string& name);
  [[nodiscard]] std::string after_power_off(const File& file);
  static void apply(std::string& content, const Change& change);

  std::string name_;
  sqlite3_vfs vfs_{};
  Random random_;
  Syncs syncs_;
  Watch watch_;
  std::map<std::string, File> files_;    // that are there
  std::map<std::string, File> removed_;  // and may be there again
  std::set<std::string> named_;          // that the folder keeps
  std::int64_t operations_ = 0;
  Losses losses_;
  std::optional<std::int64_t> off_at_;
  std::int64_t unnamed_ = 0;
  bool off_ = false;
};

}  // namespace pons::tests
