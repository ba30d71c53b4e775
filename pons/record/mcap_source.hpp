// Where a recording's bytes come from, and a part of them in memory. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "pons/core/error.hpp"
#include "pons/record/mcap_records.hpp"

namespace pons::record {

class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  // For error messages.
  [[nodiscard]] virtual std::string name() const = 0;
  // All of `into`, which lies within size(). Errors: the disk is broken; the file became shorter meanwhile.
  [[nodiscard]] virtual Expected<void> read(std::uint64_t at, std::span<std::byte> into) const = 0;
};

// Its size is what it is now: what is appended later is not seen. Errors: no such file, or it may not be read.
[[nodiscard]] Expected<std::unique_ptr<Source>> open_file(const std::filesystem::path& path);

// `bytes` must outlive it.
[[nodiscard]] std::unique_ptr<Source> open_bytes(std::span<const std::byte> bytes, std::string name);

// Shows parts of a source, small ones without a system call each.
class Window {
 public:
  explicit Window(const Source& source) : source_(source) {}

  // Valid until the next call. `count` bytes from `at` on have to be there. Errors: those of Source::read.
  [[nodiscard]] Expected<std::span<const std::byte>> view(std::uint64_t at, std::uint64_t count);

 private:
  static constexpr std::size_t kStep = std::size_t{256} * 1024;

  const Source& source_;
  std::uint64_t begin_ = 0;
  mcap::Bytes bytes_;
};

}  // namespace pons::record
