// What files are made of where the standard library tells too little of what went wrong. For this folder only.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string_view>
#include <utility>

#include "pons/core/error.hpp"

namespace pons::record {

// An open file descriptor, closed on every way out.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() { close(); }
  void close() {
    if (number_ >= 0) ::close(std::exchange(number_, -1));
  }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool open() const { return number_ >= 0; }

 private:
  int number_ = -1;
};

// "cannot WHAT: …", with how to mend what `error`, an errno, says.
[[nodiscard]] std::unexpected<Error> cannot(std::string_view what, const std::filesystem::path& where, int error);

// Where a file is written that shall become `path` once it is whole; and what such a one shall become, for messages:
// people know the name that they gave. What is no such file becomes itself.
[[nodiscard]] std::filesystem::path part_of(const std::filesystem::path& path);
[[nodiscard]] std::filesystem::path whole_of(const std::filesystem::path& part);

[[nodiscard]] std::filesystem::path folder_of(const std::filesystem::path& path);

// The file that a name stands for once links are followed: replacing the link itself would cut it off from its target.
[[nodiscard]] std::filesystem::path behind_links(const std::filesystem::path& path);

// To `part`, which was made under the name of part_of(), the mode, group and, where the system lets us, owner of the
// file that it shall replace: whoever could not read that one must not read this one. Where there is none, nothing.
void keep_mode(const std::filesystem::path& part);

// What was made, renamed or removed in a folder lasts only once this has returned. 0, or the errno of what went wrong.
[[nodiscard]] int sync_folder(const std::filesystem::path& folder);

}  // namespace pons::record
