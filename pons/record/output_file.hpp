// A new file that grows at its end. One thread at a time; blocks on the disk.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "pons/core/error.hpp"
#include "pons/record/posix.hpp"

namespace pons::record {

// Of what is yet to get its name (begin_file) errors tell that name.
class OutputFile {
 public:
  // Errors: a file of that name is there already; the folder is missing, or nothing can be written into it.
  [[nodiscard]] static Expected<OutputFile> create(const std::filesystem::path& path);

  // All of it or nothing: after an error the file ends where it ended before. Errors: the disk or its quota is full,
  // the file would become larger than the system allows, the disk is broken, or the file was removed meanwhile, so that
  // nobody would find what is written.
  // `spare`: behind it so much room more has to be there, for what ends the file; it is kept for that, where the file
  // system can do so.
  [[nodiscard]] Expected<void> append(std::span<const std::byte> bytes, std::uint64_t spare = 0);
  // What was kept and is not needed any more goes back to the disk.
  void give_back_spare();
  // What was appended survives the loss of power once this has returned. Errors: the disk is broken.
  [[nodiscard]] Expected<void> sync();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  OutputFile(std::filesystem::path path, Descriptor file) : path_(std::move(path)), file_(std::move(file)) {}
  // 0, or the errno with which no file can become so long.
  [[nodiscard]] int keep_room(std::uint64_t end);

  std::filesystem::path path_;
  Descriptor file_;
  std::uint64_t size_ = 0;
  bool keeps_room_ = false;
};

}  // namespace pons::record
