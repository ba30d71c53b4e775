// A program of the tests: writes recordings with a message of each type that Pons knows, shows what Pons reads of any,
// and records until it is killed.
//
// usage: recording_peer write FILE none|lz4|zstd     each type once, filled as pons/wire/test_fill.hpp does
//        recording_peer show FILE                    a line a message: topic, sequence, times, bytes in hexadecimal
//        recording_peer endless FOLDER none|lz4|zstd  NAME run; says "begun", then a line with what is sure to be there

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <thread>

#include "pons/record/mcap_reader.hpp"
#include "pons/record/recorder.hpp"
#include "pons/wire/test_fill.hpp"
#include "pons/wire/types/all_types.hpp"

namespace {

using namespace pons;
using record::mcap::Compression;

[[noreturn]] void give_up(const std::string& why) {
  std::fprintf(stderr, "recording_peer: %s\n", why.c_str());
  std::exit(2);
}

template <typename T>
T expect(Expected<T> value) {
  if (!value) give_up(value.error().line());
  if constexpr (!std::is_void_v<T>) return std::move(*value);
}

template <wire::Message T>
void write_one(record::McapWriter& writer, std::uint32_t index) {
  const auto topic = record::ros_topic<T>(fmt::format("/{}", T::kName));
  const auto schema = expect(writer.add_schema(topic.type, topic.schema_encoding, topic.schema));
  const auto channel = expect(writer.add_channel(schema, topic.name, topic.message_encoding, topic.metadata));
  std::vector<std::byte> bytes;
  expect(wire::encode(wire::filled<T>(), bytes));
  const record::mcap::Timestamp time = 1'700'000'000'000'000'000 + index * 100'000'000ULL;
  expect(writer.write({channel, index, time, time - 1, bytes}));
}

template <typename... Each>
void write_each(record::McapWriter& writer, wire::Types<Each...>) {
  std::uint32_t index = 0;
  for (void (*write_it)(record::McapWriter&, std::uint32_t) : {&write_one<Each>...}) write_it(writer, index++);
}

void write(const std::string& file, Compression compression) {
  const auto writer = expect(record::McapWriter::create(file, {.compression = compression}));
  write_each(*writer, wire::AllTypes{});
  const std::string_view note = "what it was recorded for";
  const auto bytes = std::as_bytes(std::span(note));
  expect(writer->attach({1, 2, "note.txt", "text/plain", {bytes.begin(), bytes.end()}}));
  expect(writer->note({"pons.run", {{"world", "parcel_cell"}}}));
  expect(writer->finish());
}

void show(const std::string& file) {
  const auto reader = expect(record::McapReader::open(file));
  const auto damage = expect(reader->each_message({}, [](const auto& message, const auto& channel) {
    std::string bytes;
    for (const std::byte each : message.data) bytes += fmt::format("{:02x}", std::to_integer<unsigned>(each));
    std::printf("%s %u %llu %llu %s\n", channel.topic.c_str(), message.sequence,
                static_cast<unsigned long long>(message.log_time),
                static_cast<unsigned long long>(message.publish_time), bytes.c_str());
    return true;
  }));
  if (damage) give_up(damage->error(file).line());
}

// A line tells of messages only once a chunk that holds them was written; a reader after the kill must find as many.
[[noreturn]] void endless(const std::string& folder, Compression compression) {
  record::RecorderOptions options;
  options.folder = folder;
  options.name = "run";
  options.queue_bytes = std::size_t{1} << 20U;
  options.file_bytes = std::uint64_t{1} << 40U;
  options.writer.compression = compression;
  options.writer.chunk_bytes = 4000;
  const auto recorder = expect(record::Recorder::open(options));
  const auto topic = recorder->add_topic({"/count", "", "", "", "cdr", {}});
  std::puts("begun");
  for (std::uint32_t i = 0;; ++i) {
    const std::string data = fmt::format("{:0100}", i);
    if (!recorder->record(topic, i, i, std::as_bytes(std::span(data)))) give_up("the queue is full");
    recorder->work_off();
    if (i % 100 != 99) continue;
    recorder->advance(i + 2'000'000'000ULL);  // so that nothing waits
    recorder->work_off();
    std::printf("%u\n", i + 1);
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string mode = argc > 2 ? argv[1] : "";
  const std::string named = argc > 3 ? argv[3] : "none";
  const auto compression = record::mcap::compression_named(named == "none" ? "" : named);
  if (!compression) give_up("no such compression");
  if (mode == "write") write(argv[2], *compression);
  if (mode == "show") show(argv[2]);
  if (mode == "endless") endless(argv[2], *compression);
  return mode == "write" || mode == "show" ? 0 : 2;
}
