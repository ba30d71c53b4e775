// A file that nobody sees before it is whole. One thread at a time; blocks on the disk.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/record/output_file.hpp"

namespace pons::record {

enum class Overwrite { kNever, kAllowed };

// How to mend that there is such a file already: programs tell in their own words how to allow it.
inline constexpr std::string_view kAllowIt = "choose another name, or allow it to be overwritten";

// The name under which a file is written that shall become `path`, or what that leads to if it is a symbolic link that
// may be overwritten. Errors: those of check_writable; `path` exists, if only as a link that leads nowhere, and may not
// be overwritten.
[[nodiscard]] Expected<std::filesystem::path> begin_file(const std::filesystem::path& path, Overwrite overwrite);
// For what is made of a recording. Error: `path` is that file, under whatever name.
[[nodiscard]] Expected<void> check_is_not(const std::filesystem::path& recording, const std::filesystem::path& path);
// It gets its name, which nobody loses who made such a file meanwhile, and the mode of the file that it replaces; or,
// where that fails, is removed.
[[nodiscard]] Expected<void> end_file(const std::filesystem::path& part, const std::filesystem::path& path,
                                      Overwrite overwrite);

// Text that is written so, a piece of it at a time.
class NewText {
 public:
  [[nodiscard]] static Expected<NewText> create(const std::filesystem::path& path, Overwrite overwrite);
  ~NewText();  // without end() nothing is left of it
  NewText(NewText&&) noexcept = default;
  NewText& operator=(NewText&&) = delete;

  [[nodiscard]] Expected<void> add(std::string_view text);
  // All of it is on the disk; of end() the name is left.
  [[nodiscard]] Expected<void> settle();
  [[nodiscard]] Expected<void> end();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  NewText(std::filesystem::path path, Overwrite overwrite, OutputFile file)
      : path_(std::move(path)), overwrite_(overwrite), file_(std::move(file)) {}
  [[nodiscard]] Expected<void> flush();

  std::filesystem::path path_;
  Overwrite overwrite_;
  std::optional<OutputFile> file_;
  std::string waiting_;
};

}  // namespace pons::record
