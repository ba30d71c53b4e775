// A recording as anybody may hand it over, or a disk may leave it: any bytes. Opened, read, checked; what is said of it
// is readable, and the ways to read it agree.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/ros_types.hpp"

namespace {

using namespace pons;

// So that a few bytes that promise many are refused instead of tried.
constexpr record::ReadLimits kLimits{.record_bytes = std::uint64_t{1} << 20U};

[[noreturn]] void found(const std::string& what) {
  std::fprintf(stderr, "fuzz_mcap: %s\n", what.c_str());
  std::abort();
}

void expect_readable(const Error& error) {
  const std::string line = error.line();
  if (line.empty() || line.size() > 1000) found("an error that cannot be read: " + line);
}

void take(std::span<const std::byte> bytes) {
  const auto source = record::open_bytes(bytes, "file");
  const auto verdict = record::check(*source, kLimits);
  if (!verdict) expect_readable(verdict.error());
  const auto reader = record::McapReader::open(record::open_bytes(bytes, "file"), kLimits);
  if (reader.has_value() != verdict.has_value()) found("it can be opened or checked, but not both");
  if (!reader) return expect_readable(reader.error());
  const record::Contents& contents = (*reader)->contents();
  std::uint64_t messages = 0;
  const auto read = (*reader)->each_message({}, [&](const auto&, const auto&) { return ++messages > 0; });
  if (!read) found("memory cannot be read: " + read.error().line());
  for (const record::Damage& each : verdict->damage) {
    if (each.at > bytes.size()) found("damage behind its end");
    expect_readable(each.error("file"));
  }
  if (!contents.from_summary && messages != contents.statistics.messages) found("it is read and counted differently");
  if (verdict->whole() && (*read || !contents.finished || contents.damage)) found("it is whole, and it is not");
  if (verdict->whole() && messages != verdict->messages) found("it is checked and read differently");
  if (verdict->whole() && contents.statistics.messages != messages) found("a whole one says otherwise");
  for (const auto& each : contents.attachments) {
    if (const auto attachment = (*reader)->attachment(each); !attachment) expect_readable(attachment.error());
  }
  for (const auto& each : contents.metadata) {
    if (const auto metadata = (*reader)->metadata(each); !metadata) expect_readable(metadata.error());
  }
  for (const auto& [id, channel] : contents.channels) {
    if (const auto type = record::known_type_of(contents, channel); !type) (void)type.error().line();
  }
}

}  // namespace

// libFuzzer calls it so: NOLINTNEXTLINE(readability-identifier-naming)
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  take(std::as_bytes(std::span(data, size)));
  return 0;
}
