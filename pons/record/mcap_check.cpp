#include "pons/record/mcap_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "pons/record/mcap_gather.hpp"
#include "pons/record/mcap_records.hpp"
#include "pons/record/mcap_summary.hpp"

namespace pons::record {
namespace {

constexpr std::size_t kTold = 20;

void tell(Verdict& verdict, std::uint64_t at, std::string what) {
  if (verdict.damage.size() < kTold)
    verdict.damage.push_back({at, std::move(what)});
  else
    ++verdict.further;
}

// The data, and what they are found to hold.
class DataCheck : public DataVisitor {
 public:
  explicit DataCheck(Verdict& verdict) : verdict_(verdict) {}

  void schema(const mcap::Schema& schema) override { contents_.schemas.emplace(schema.id, schema); }
  void channel(const mcap::Channel& channel) override { contents_.channels.emplace(channel.id, channel); }
  void chunk(const ChunkPlace& place) override {
    end_chunk();
    behind_damage_ = false;
    const auto& head = place.head;
    chunk_ = mcap::ChunkIndex{head.start, head.end,         place.offset,      place.length,          {},
                              0,          head.compression, head.records_size, head.uncompressed_size};
  }
  bool message(const mcap::Message& message, const mcap::Channel&, const MessagePlace& place) override {
    auto& statistics = contents_.statistics;
    statistics.start = statistics.messages == 0 ? message.log_time : std::min(statistics.start, message.log_time);
    statistics.end = std::max(statistics.end, message.log_time);
    ++statistics.messages;
    ++statistics.channel_messages[message.channel];
    if (place.chunk == nullptr) {
      ++loose_;
      return true;
    }
    start_ = entries_.empty() ? message.log_time : std::min(start_, message.log_time);
    end_ = entries_.empty() ? message.log_time : std::max(end_, message.log_time);
    entries_[message.channel].push_back({message.log_time, place.offset});
    return true;
  }
  [[nodiscard]] bool wants_message_indexes() const override { return true; }
  void message_index(const mcap::MessageIndex& index, std::uint64_t at, std::uint64_t length) override {
    if (!chunk_ && behind_damage_) return;  // of a chunk that could not be read
    if (!chunk_) return tell(verdict_, at, "a Message Index follows no chunk");
    if (index.entries.empty()) return;  // of a channel that the chunk does not hold, some writers put one
    if (!chunk_->message_indexes.emplace(index.channel, at).second)
      return tell(verdict_, at, fmt::format("the chunk has two indexes of channel {}", index.channel));
    if (chunk_->message_index_length == 0) index_at_ = at;
    chunk_->message_index_length = at + length - index_at_;
    const auto by_place = [](const auto& a, const auto& b) { return a.offset < b.offset; };
    auto sorted = index.entries;
    std::ranges::sort(sorted, by_place);
    const auto found = entries_.find(index.channel);
    if (found == entries_.end() || found->second != sorted)
      tell(verdict_, at, fmt::format("the Message Index of channel {} is not that of its chunk", index.channel));
  }
  void attachment(const mcap::AttachmentIndex& index, const mcap::Attachment&) override {
    end_chunk();
    contents_.attachments.push_back(index);
  }
  void metadata(const mcap::MetadataIndex& index, const mcap::Metadata&) override {
    end_chunk();
    contents_.metadata.push_back(index);
  }
  void damage(const Damage& damage) override {
    tell(verdict_, damage.at, damage.what);
    if (chunk_ && damage.at < chunk_->offset + chunk_->length) forget_chunk();
    end_chunk();
    behind_damage_ = true;
  }

  // After the last of its indexes.
  void end_chunk() {
    if (!chunk_) return;
    if (chunk_->start != start_ || chunk_->end != end_)
      tell(verdict_, chunk_->offset, "the chunk says other times than its messages have");
    if (!chunk_->message_indexes.empty() && chunk_->message_indexes.size() != entries_.size())
      tell(verdict_, chunk_->offset, "the chunk has messages of channels of which there is no index behind it");
    contents_.chunks.push_back(*chunk_);
    forget_chunk();
  }

  [[nodiscard]] const Contents& contents() const { return contents_; }
  [[nodiscard]] std::uint64_t loose() const { return loose_; }

 private:
  void forget_chunk() {
    chunk_.reset();
    entries_.clear();
    start_ = end_ = 0;
  }

  Verdict& verdict_;
  Contents contents_;
  std::optional<mcap::ChunkIndex> chunk_;
  std::map<std::uint16_t, std::vector<mcap::MessageIndexEntry>> entries_;  // of the chunk
  bool behind_damage_ = false;
  mcap::Timestamp start_ = 0, end_ = 0;
  std::uint64_t index_at_ = 0;  // the first behind the chunk
  std::uint64_t loose_ = 0;     // messages outside of chunks
};

// Holds what the summary says against what there is.
class SummaryCheck {
 public:
  SummaryCheck(const Summary& summary, const Contents& there, Verdict& verdict)
      : summary_(summary), said_(summary.contents), there_(there), verdict_(verdict) {}

  void run() {
    described("schema", said_.schemas, there_.schemas);
    described("channel", said_.channels, there_.channels);
    if (!said_.chunks.empty()) listed("chunks", chunks_said(), there_.chunks);
    if (!said_.attachments.empty()) listed("attachments", said_.attachments, there_.attachments);
    if (!said_.metadata.empty()) listed("metadata", said_.metadata, there_.metadata);
    if (summary_.statistics) statistics(*summary_.statistics);
  }

 private:
  void wrong(const std::string& what) { tell(verdict_, summary_.footer.summary_start, "the summary " + what); }

  template <typename T>
  void described(const char* kind, const std::map<std::uint16_t, T>& said, const std::map<std::uint16_t, T>& there) {
    for (const auto& [id, each] : said) {
      const auto found = there.find(id);
      if (found == there.end() || !(found->second == each))
        wrong(fmt::format("describes {} {} otherwise than the data do", kind, id));
    }
  }

  // Writers need not name the indexes of channels; of those that do, empty ones do not count.
  [[nodiscard]] std::vector<mcap::ChunkIndex> chunks_said() const {
    auto said = said_.chunks;
    for (std::size_t i = 0; i < said.size() && said.size() == there_.chunks.size(); ++i) {
      if (!said[i].message_indexes.empty() && !there_.chunks[i].message_indexes.empty()) {
        std::erase_if(said[i].message_indexes,
                      [&](const auto& each) { return !there_.chunks[i].message_indexes.contains(each.first); });
        continue;
      }
      said[i].message_indexes = there_.chunks[i].message_indexes;
      said[i].message_index_length = there_.chunks[i].message_index_length;
    }
    return said;
  }

  template <typename T>
  void listed(const char* kind, std::vector<T> said, std::vector<T> there) {
    const auto by_place = [](const T& a, const T& b) { return a.offset < b.offset; };
    std::ranges::sort(said, by_place);
    std::ranges::sort(there, by_place);
    if (said != there) wrong(fmt::format("lists other {} than there are", kind));
  }

  void statistics(const mcap::Statistics& said) {
    const auto& counted = there_.statistics;
    auto channels = said.channel_messages;
    std::erase_if(channels, [](const auto& each) { return each.second == 0; });
    const bool times = said.start == counted.start && said.end == counted.end;
    const bool counts = said.messages == counted.messages && said.chunks == there_.chunks.size() &&
                        said.attachments == there_.attachments.size() && said.metadata == there_.metadata.size() &&
                        said.channels == there_.channels.size() && said.schemas == there_.schemas.size();
    const bool each = said.channel_messages.empty() || channels == counted.channel_messages;
    if (!times || !counts || !each) wrong("counts otherwise than the data do");
  }

  const Summary& summary_;
  const Contents& said_;
  const Contents& there_;
  Verdict& verdict_;
};

// Of all bytes before `end`.
Expected<std::uint32_t> checksum(const Source& source, std::uint64_t end) {
  constexpr std::uint64_t kStep = std::uint64_t{1} << 20U;
  Window window(source);
  std::uint32_t crc = 0;
  for (std::uint64_t at = 0; at < end; at += kStep) {
    const auto bytes = window.view(at, std::min(kStep, end - at));
    if (!bytes) return std::unexpected(bytes.error());
    crc = mcap::crc32(crc, *bytes);
  }
  return crc;
}

void count(const Contents& contents, Verdict& verdict) {
  verdict.chunks = contents.chunks.size();
  verdict.messages = contents.statistics.messages;
  verdict.attachments = contents.attachments.size();
  verdict.metadata = contents.metadata.size();
}

// The summary of a file whose data have ended as they should.
Expected<void> check_summary(const Source& source, const ReadLimits& limits, const DataCheck& data, Verdict& verdict) {
  const auto summary = read_summary(source, limits);
  if (!summary) return std::unexpected(summary.error());
  if (!*summary) {
    tell(verdict, summary->error().at, summary->error().what);
  } else if (**summary && verdict.whole()) {  // of what is damaged it must say something else
    SummaryCheck(***summary, data.contents(), verdict).run();
    if (!(***summary).contents.chunks.empty() && data.loose() > 0)
      tell(verdict, (***summary).footer.summary_start,
           fmt::format("the summary lists chunks, and {} messages lie outside of them", data.loose()));
  }
  return {};
}

}  // namespace

Expected<Verdict> check(const Source& source, const ReadLimits& limits) {
  Verdict verdict;
  DataCheck data(verdict);
  const auto walked = walk(source, limits, data);
  if (!walked) return std::unexpected(walked.error());
  data.end_chunk();
  verdict.bytes = source.size();
  if (walked->data_end && walked->data_end->data_section_crc != 0) {
    const auto is = checksum(source, walked->data_end_at);
    if (!is) return std::unexpected(is.error());
    if (*is != walked->data_end->data_section_crc)
      tell(verdict, walked->data_end_at, "the data are not those of which the Data End has the checksum");
  }
  if (walked->ended && !walked->data_end) tell(verdict, walked->at, "no Data End ends the data");
  if (walked->ended) {
    if (auto checked = check_summary(source, limits, data, verdict); !checked) return std::unexpected(checked.error());
  }
  if (verdict.whole()) {
    count(data.contents(), verdict);
    return verdict;
  }
  const auto left = gather(source, limits);
  if (!left) return std::unexpected(left.error());
  count(*left, verdict);
  return verdict;
}

}  // namespace pons::record
