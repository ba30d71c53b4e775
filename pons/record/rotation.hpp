// The files of one recording: NAME_0.mcap, or NAME.mcap where it is to be so, then NAME_1.mcap and so on, in one
// folder; the oldest go when they take too much room together, and never one that is not this recording's. One thread
// at a time; blocks on the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::record {

// The name of the first.
enum class FirstFile : std::uint8_t { kNumbered, kPlain };

class Rotation {
 public:
  // New files follow those of that name that are there. `beginning`: by which bytes its own files are known; those that
  // are there count, and are removed with the others. Without, what is there is somebody else's.
  // Errors: the folder is missing or cannot be read; `name` is empty or no file name; with `beginning`, a file of that
  // name begins otherwise.
  [[nodiscard]] static Expected<Rotation> open(const std::filesystem::path& folder, const std::string& name,
                                               FirstFile first = FirstFile::kNumbered,
                                               std::span<const std::byte> beginning = {});
  // Of "NAME_12.mcap" 12; of "NAME.mcap" 0, where the first is called so. Nothing: it will never be one of that name.
  [[nodiscard]] static std::optional<std::uint64_t> number_of(std::string_view file, std::string_view name,
                                                              FirstFile first);

  // For a new file.
  [[nodiscard]] std::filesystem::path next_path();
  // It is finished, and counts.
  void add(const std::filesystem::path& path, std::uint64_t bytes);
  // Removes the oldest until they and `needed` bytes more take no more than `quota`. Errors: one cannot be removed.
  [[nodiscard]] Expected<void> make_room(std::uint64_t needed, std::uint64_t quota);
  // Of those that there are, for it must not be empty(). Errors: it cannot be removed.
  [[nodiscard]] Expected<void> remove_oldest();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  // Nothing of that name was there, and none was begun.
  [[nodiscard]] bool at_first() const { return next_ == 0; }
  // Of its files, whoever wrote them.
  [[nodiscard]] bool empty() const { return files_.empty(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t removed() const { return removed_; }
  // Of those that were added, what there is; their paths if there are any.
  struct Added {
    std::uint64_t files = 0, bytes = 0;
    std::filesystem::path first, last;
  };
  [[nodiscard]] Added added() const;
  [[nodiscard]] std::uint64_t added_bytes() const { return added_bytes_; }

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
  std::size_t found_ = 0;   // the first so many of them were there before
  std::uint64_t next_ = 0, bytes_ = 0, added_bytes_ = 0, removed_ = 0;
};

}  // namespace pons::record
