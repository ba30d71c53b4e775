#include "pons/record/mcap_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/record/mcap_records.hpp"

namespace pons::record {

using mcap::kPrefix;
using mcap::Opcode;

namespace {

class SummaryReader {
 public:
  SummaryReader(const Source& source, const ReadLimits& limits) : source_(source), limits_(limits), window_(source) {}

  // Damage is thrown within this class only.
  SummaryRead run() {
    try {
      return std::expected<std::optional<Summary>, Damage>(read());
    } catch (const Damage& damage) {
      return std::expected<std::optional<Summary>, Damage>(std::unexpected(damage));
    } catch (const Error& error) {
      return std::unexpected(error);
    }
  }

 private:
  std::span<const std::byte> view(std::uint64_t at, std::uint64_t count) {
    auto viewed = window_.view(at, count);
    if (!viewed) throw Error(viewed.error());
    return *viewed;
  }

  [[noreturn]] static void damaged(std::uint64_t at, std::string what) { throw Damage{at, std::move(what)}; }

  std::optional<Summary> read() {
    constexpr std::uint64_t kEnd = kPrefix + mcap::kFooterContent + mcap::kMagic.size();
    const std::uint64_t size = source_.size();
    if (size < mcap::kMagic.size() + kEnd) damaged(size, "the file ends too early to have an end");
    summary_.footer_at = size - kEnd;
    const auto end = view(summary_.footer_at, kEnd);
    const mcap::Prefix prefix = mcap::read_prefix(end.first<kPrefix>());
    const bool has_footer = prefix.opcode == Opcode::kFooter && prefix.length == mcap::kFooterContent &&
                            std::ranges::equal(end.last(mcap::kMagic.size()), mcap::kMagic);
    if (!has_footer) damaged(size, "the file does not end with a Footer: it was not finished");
    (void)mcap::read(end.subspan(kPrefix, mcap::kFooterContent), summary_.footer);
    if (summary_.footer.summary_start == 0) return std::nullopt;
    check_footer();
    for (std::uint64_t at = summary_.footer.summary_start; at < summary_.footer_at;) at = take(at);
    return std::move(summary_);
  }

  void check_footer() {
    const auto& [start, offsets, crc] = summary_.footer;
    if (start < mcap::kMagic.size() || start > summary_.footer_at)
      damaged(summary_.footer_at, fmt::format("the Footer says that the summary begins at byte {}", start));
    if (offsets != 0 && (offsets < start || offsets > summary_.footer_at))
      damaged(summary_.footer_at, fmt::format("the Footer says that the summary's offsets begin at byte {}", offsets));
    if (crc == 0) return;
    constexpr std::uint64_t kStep = std::uint64_t{1} << 20U;
    const std::uint64_t until = summary_.footer_at + kPrefix + mcap::kFooterContent - sizeof crc;
    std::uint32_t is = 0;
    for (std::uint64_t at = start; at < until; at += kStep) is = mcap::crc32(is, view(at, std::min(kStep, until - at)));
    if (is != crc) damaged(start, "the summary is damaged: its checksum is wrong");
  }

  // Where the next one begins.
  std::uint64_t take(std::uint64_t at) {
    const std::uint64_t left = summary_.footer_at - at;
    if (left < kPrefix) damaged(at, "there is no whole record in the summary");
    const mcap::Prefix prefix = mcap::read_prefix(view(at, kPrefix).first<kPrefix>());
    if (prefix.opcode == Opcode::kNone || prefix.length > left - kPrefix)
      damaged(at, "there is no whole record in the summary");
    if (prefix.length > limits_.record_bytes) damaged(at, "a record of the summary is too long");
    const std::uint64_t next = at + kPrefix + prefix.length;
    if (!take_record(prefix.opcode, view(at + kPrefix, prefix.length)))
      damaged(at, fmt::format("the {} record ends before its fields do", mcap::name_of(prefix.opcode)));
    return next;
  }

  bool take_record(Opcode opcode, std::span<const std::byte> content) {
    Contents& contents = summary_.contents;
    switch (opcode) {
      case Opcode::kSchema:
        return take_as<mcap::Schema>(content, [&](auto& each) {
          if (each.id != 0) contents.schemas.emplace(each.id, std::move(each));
        });
      case Opcode::kChannel:
        return take_as<mcap::Channel>(content,
                                      [&](auto& each) { contents.channels.emplace(each.id, std::move(each)); });
      case Opcode::kStatistics:
        return take_as<mcap::Statistics>(content, [&](auto& each) { summary_.statistics = std::move(each); });
      case Opcode::kChunkIndex:
        return take_as<mcap::ChunkIndex>(content, [&](auto& each) { contents.chunks.push_back(std::move(each)); });
      case Opcode::kAttachmentIndex:
        return take_as<mcap::AttachmentIndex>(content,
                                              [&](auto& each) { contents.attachments.push_back(std::move(each)); });
      case Opcode::kMetadataIndex:
        return take_as<mcap::MetadataIndex>(content, [&](auto& each) { contents.metadata.push_back(std::move(each)); });
      case Opcode::kSummaryOffset:
        return take_as<mcap::SummaryOffset>(content, [&](auto& each) { summary_.offsets.push_back(each); });
      default:
        return true;
    }
  }

  template <typename T, typename Use>
  static bool take_as(std::span<const std::byte> content, const Use& use) {
    T record;
    if (!mcap::read(content, record)) return false;
    use(record);
    return true;
  }

  const Source& source_;
  const ReadLimits& limits_;
  Window window_;
  Summary summary_;
};

}  // namespace

SummaryRead read_summary(const Source& source, const ReadLimits& limits) { return SummaryReader(source, limits).run(); }

bool tells_all(const Summary& summary) {
  if (!summary.statistics) return false;
  const auto& statistics = *summary.statistics;
  const Contents& contents = summary.contents;
  std::uint64_t counted = 0;
  for (const auto& [channel, count] : statistics.channel_messages) {
    if (!contents.channels.contains(channel)) return false;
    counted += count;
  }
  // A channel's schema that is not told, may be in the data.
  for (const auto& [id, channel] : contents.channels) {
    if (channel.schema != 0 && !contents.schemas.contains(channel.schema)) return false;
  }
  return counted == statistics.messages && contents.channels.size() == statistics.channels &&
         contents.chunks.size() == statistics.chunks && contents.attachments.size() == statistics.attachments &&
         contents.metadata.size() == statistics.metadata;
}

}  // namespace pons::record
