// The files of one recording: NAME_0.mcap, or NAME.mcap where it is to be so, then NAME_1.mcap and so on, in one
// folder; the oldest go when they take too much room together. One thread at a time; blocks on the disk.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <string>

#include "pons/core/error.hpp"

namespace pons::record {

// The name of the first.
enum class FirstFile : std::uint8_t { kNumbered, kPlain };

class Rotation {
 public:
  // Finds the files of that name that are there; new ones follow them. Errors: the folder is missing or cannot be read;
  // `name` is empty or no file name.
  [[nodiscard]] static Expected<Rotation> open(const std::filesystem::path& folder, const std::string& name,
                                               FirstFile first = FirstFile::kNumbered);

  // For a new file.
  [[nodiscard]] std::filesystem::path next_path();
  // It is finished, and counts.
  void add(const std::filesystem::path& path, std::uint64_t bytes);
  // Removes the oldest until they and `needed` bytes more take no more than `quota`. Errors: one cannot be removed.
  [[nodiscard]] Expected<void> make_room(std::uint64_t needed, std::uint64_t quota);
  // Of those that there are, for it must not be empty(). Errors: it cannot be removed.
  [[nodiscard]] Expected<void> remove_oldest();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] bool empty() const { return files_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t removed() const { return removed_; }  // files

 private:
  struct File {
    std::filesystem::path path;
    std::uint64_t bytes = 0;
  };

  Rotation(std::filesystem::path folder, std::string name, FirstFile first)
      : folder_(std::move(folder)), name_(std::move(name)), first_(first) {}

  std::filesystem::path folder_;
  std::string name_;
  FirstFile first_;
  std::deque<File> files_;  // oldest first
  std::uint64_t next_ = 0, bytes_ = 0, removed_ = 0;
};

}  // namespace pons::record
