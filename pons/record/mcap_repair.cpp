#include <unistd.h>

#include <algorithm>
#include <map>
#include <utility>

#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_gather.hpp"
#include "pons/record/mcap_writer.hpp"
#include "pons/record/new_file.hpp"
#include "pons/record/posix.hpp"

namespace pons::record {
namespace {

// The compression that most of its chunks have, and its profile.
WriterOptions options_of(const Contents& contents) {
  std::map<mcap::Compression, std::uint64_t> chunks;
  for (const auto& each : contents.chunks) {
    if (const auto named = mcap::compression_named(each.compression)) ++chunks[*named];
  }
  WriterOptions options;
  options.profile = contents.header.profile;
  options.sync_every = std::chrono::hours(24 * 365);  // in the end
  std::uint64_t most = 0;
  for (const auto& [compression, count] : chunks) {
    if (count > most) options.compression = compression;
    most = std::max(most, count);
  }
  return options;
}

class Copy : public DataVisitor {
 public:
  Copy(McapWriter& to, const Contents& contents) : to_(to) {
    for (const auto& [id, each] : contents.schemas)
      keep(to.add_schema(each.name, each.encoding, each.data), schemas_, id);
    for (const auto& [id, each] : contents.channels) {
      const auto schema = schemas_.find(each.schema);
      keep(to.add_channel(schema == schemas_.end() ? std::uint16_t{0} : schema->second, each.topic,
                          each.message_encoding, each.metadata),
           channels_, id);
    }
  }
  bool message(const mcap::Message& message, const mcap::Channel& channel, const MessagePlace&) override {
    mcap::Message copy = message;
    copy.channel = channels_[channel.id];
    keep(to_.write(copy));
    return !failed_;
  }
  void attachment(const mcap::AttachmentIndex&, const mcap::Attachment& attachment) override {
    keep(to_.attach(attachment));
  }
  void metadata(const mcap::MetadataIndex&, const mcap::Metadata& metadata) override { keep(to_.note(metadata)); }
  [[nodiscard]] const std::optional<Error>& failed() const { return failed_; }

 private:
  using Ids = std::map<std::uint16_t, std::uint16_t>;
  void keep(const Expected<std::uint16_t>& id, Ids& ids, std::uint16_t of) {
    if (id) ids[of] = *id;
    if (!id && !failed_) failed_ = id.error();
  }
  void keep(const Expected<void>& done) {
    if (!done && !failed_) failed_ = done.error();
  }

  McapWriter& to_;
  Ids schemas_, channels_;
  std::optional<Error> failed_;
};

Expected<void> write_copy(const Source& source, const std::filesystem::path& path, const ReadLimits& limits) {
  const auto contents = gather(source, limits);
  if (!contents) return std::unexpected(contents.error());
  auto writer = McapWriter::create(path, options_of(*contents));
  if (!writer) return std::unexpected(writer.error());
  keep_mode(path);  // before there are messages to be read in it
  Copy copy(**writer, *contents);
  if (copy.failed()) return std::unexpected(*copy.failed());
  const auto copied = walk(source, limits, copy, {contents->schemas, contents->channels});
  if (!copied) return std::unexpected(copied.error());
  if (copy.failed()) return std::unexpected(*copy.failed());
  return (*writer)->finish();
}

}  // namespace

Expected<void> repair(const Source& source, const std::filesystem::path& path, Overwrite overwrite,
                      const ReadLimits& limits) {
  const auto part = begin_file(path, overwrite);
  if (!part) return std::unexpected(part.error());
  if (auto written = write_copy(source, *part, limits); !written) {
    ::unlink(part->c_str());
    return written;
  }
  return end_file(*part, path, overwrite);
}

}  // namespace pons::record
