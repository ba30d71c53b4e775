// What makes chunks of a recording smaller, and its checksum. An object belongs to one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::record::mcap {

class Bytes;

// As zip files and MCAP have it (polynomial 0xEDB88320): of what `so_far` is the checksum of, 0 for nothing, and
// `bytes` after it.
[[nodiscard]] std::uint32_t crc32(std::uint32_t so_far, std::span<const std::byte> bytes);

enum class Compression { kNone, kLz4, kZstd };

// As MCAP names it: "", "lz4" (frames), "zstd".
[[nodiscard]] std::string_view name_of(Compression compression);
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name);

class Compressor {
 public:
  // `level`: zstd's, or of lz4 0 for fast, 3 and more for small; higher is smaller and slower.
  Compressor(Compression compression, int level);
  ~Compressor();
  Compressor(const Compressor&) = delete;
  Compressor& operator=(const Compressor&) = delete;

  // Adds the compressed form of `bytes` to `to`. Errors: memory ran out.
  [[nodiscard]] Expected<void> add(std::span<const std::byte> bytes, Bytes& to);

 private:
  struct Contexts;
  Compression compression_;
  int level_;
  std::unique_ptr<Contexts> contexts_;
};

class Decompressor {
 public:
  Decompressor();
  ~Decompressor();
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;

  // In place of what `to` held: the `size` bytes that `bytes` were made of. Memory grows with what comes out, whatever
  // `size` promises. Errors (what, no place): it is no such data, is cut, or holds less or more than `size`.
  [[nodiscard]] Expected<void> take(Compression compression, std::span<const std::byte> bytes, std::uint64_t size,
                                    Bytes& to);

 private:
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
};

}  // namespace pons::record::mcap
