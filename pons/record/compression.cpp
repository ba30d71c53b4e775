#include "pons/record/compression.hpp"

#include <fmt/format.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <utility>

#include "pons/record/mcap_records.hpp"

namespace pons::record::mcap {
namespace {

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};
struct FreeZstd {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

// What one step took in and gave out, and whether a frame has ended with it.
struct Step {
  std::size_t taken = 0, given = 0;
  bool ended = false;
};

constexpr const char* kNotSuch = "its records cannot be decompressed";

}  // namespace

std::uint32_t crc32(std::uint32_t so_far, std::span<const std::byte> bytes) {
  return libdeflate_crc32(so_far, bytes.data(), bytes.size());
}

std::string_view name_of(Compression compression) {
  switch (compression) {
    case Compression::kNone:
      return "";
    case Compression::kLz4:
      return "lz4";
    case Compression::kZstd:
      return "zstd";
  }
  std::unreachable();
}

std::optional<Compression> compression_named(std::string_view name) {
  for (const Compression each : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    if (name == name_of(each)) return each;
  }
  return std::nullopt;
}

struct Compressor::Contexts {
  std::unique_ptr<ZSTD_CCtx, FreeZstd> zstd;
};

Compressor::Compressor(Compression compression, int level)
    : compression_(compression), level_(level), contexts_(std::make_unique<Contexts>()) {
  if (compression == Compression::kZstd) contexts_->zstd.reset(ZSTD_createCCtx());
}

Compressor::~Compressor() = default;

Expected<void> Compressor::add(std::span<const std::byte> bytes, Bytes& to) {
  if (compression_ == Compression::kNone) {
    to.raw(bytes);
    return {};
  }
  const std::size_t before = to.size();
  std::size_t made = 0;
  bool failed = false;
  if (compression_ == Compression::kZstd) {
    const std::size_t room = ZSTD_compressBound(bytes.size());
    made = ZSTD_compressCCtx(contexts_->zstd.get(), to.grow(room), room, bytes.data(), bytes.size(), level_);
    failed = ZSTD_isError(made) != 0U;
  } else {
    LZ4F_preferences_t preferences{};
    preferences.compressionLevel = level_;
    preferences.frameInfo.contentSize = bytes.size();
    preferences.frameInfo.blockSizeID = LZ4F_max4MB;
    const std::size_t room = LZ4F_compressFrameBound(bytes.size(), &preferences);
    made = LZ4F_compressFrame(to.grow(room), room, bytes.data(), bytes.size(), &preferences);
    failed = LZ4F_isError(made) != 0U;
  }
  to.shrink_to(failed ? before : before + made);
  if (failed) return fail("a chunk cannot be compressed", "", "give the program more memory");
  return {};
}

struct Decompressor::Contexts {
  std::unique_ptr<ZSTD_DCtx, FreeZstd> zstd;
  std::unique_ptr<LZ4F_dctx, FreeLz4> lz4;

  // Each of the two: nothing where it is no such data.
  std::optional<Step> zstd_step(std::span<const std::byte> in, std::span<std::byte> out) const {
    ZSTD_inBuffer from{in.data(), in.size(), 0};
    ZSTD_outBuffer to{out.data(), out.size(), 0};
    const std::size_t left = ZSTD_decompressStream(zstd.get(), &to, &from);
    if (ZSTD_isError(left) != 0U) return std::nullopt;
    return Step{from.pos, to.pos, left == 0};
  }
  std::optional<Step> lz4_step(std::span<const std::byte> in, std::span<std::byte> out) const {
    std::size_t taken = in.size(), given = out.size();
    const std::size_t left = LZ4F_decompress(lz4.get(), out.data(), &given, in.data(), &taken, nullptr);
    if (LZ4F_isError(left) != 0U) return std::nullopt;
    return Step{taken, given, left == 0};
  }
};

Decompressor::Decompressor() : contexts_(std::make_unique<Contexts>()) {}
Decompressor::~Decompressor() = default;

Expected<void> Decompressor::take(Compression compression, std::span<const std::byte> bytes, std::uint64_t size,
                                  Bytes& to) {
  to.clear();
  if (compression == Compression::kNone) {
    if (bytes.size() != size) return fail("its records are not as long as it says");
    to.raw(bytes);
    return {};
  }
  if (compression == Compression::kZstd) {
    if (!contexts_->zstd) contexts_->zstd.reset(ZSTD_createDCtx());
    ZSTD_DCtx_reset(contexts_->zstd.get(), ZSTD_reset_session_only);
  } else {
    LZ4F_dctx* made = nullptr;
    if (!contexts_->lz4 && LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) == 0U)
      contexts_->lz4.reset(made);
    LZ4F_resetDecompressionContext(contexts_->lz4.get());
  }
  // One byte more than it should hold: whether more would come, is seen so.
  constexpr std::size_t kLeast = 64 * 1024;
  std::size_t in = 0, out = 0;
  bool ended = bytes.empty();
  std::size_t room = std::min<std::uint64_t>(size + 1, std::max(kLeast, 8 * bytes.size()));
  (void)to.grow(room);
  while (in < bytes.size() || !ended) {
    if (out == room && room <= size) {
      const std::size_t more = std::min<std::uint64_t>(size + 1 - room, room);
      (void)to.grow(more);
      room += more;
    }
    const std::span<std::byte> into(to.data() + out, room - out);
    const auto step = compression == Compression::kZstd ? contexts_->zstd_step(bytes.subspan(in), into)
                                                        : contexts_->lz4_step(bytes.subspan(in), into);
    if (!step) return fail(kNotSuch);
    in += step->taken;
    out += step->given;
    ended = step->ended;
    if (out > size) return fail("it holds more than it says");
    if (step->taken == 0 && step->given == 0 && out < room)
      return fail(kNotSuch);  // it waits for bytes that are not there
  }
  to.shrink_to(out);
  if (out != size) return fail("it holds less than it says");
  return {};
}

}  // namespace pons::record::mcap
