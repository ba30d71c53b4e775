// pons recording: what one holds, whether it is whole, a whole one of what is left, and tables of it.

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <system_error>

#include "apps/commands.hpp"
#include "apps/run_facts.hpp"
#include "apps/run_kit.hpp"
#include "pons/record/export.hpp"
#include "pons/record/mcap_check.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/recorder.hpp"
#include "pons/record/video.hpp"
#include "pons/wire/json.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
namespace mcap = record::mcap;
using record::McapReader;

struct RecordingOptions {
  fs::path file, output, csv, jsonl, mp4;
  std::vector<std::string> topics;
  bool overwrite = false, json = false;

  [[nodiscard]] record::Overwrite overwriting() const {
    return overwrite ? record::Overwrite::kAllowed : record::Overwrite::kNever;
  }
};

// One topic may have several publishers, each with a channel.
struct Row {
  std::uint64_t messages = 0, dropped = 0;
};
using Rows = std::map<std::pair<std::string, std::string>, Row>;  // topic, type

constexpr const char* kInterrupted = "interrupted";

// A recording until somebody says Ctrl-C: whoever reads it hears then what he would hear of a broken disk, and leaves
// nothing half-written, either.
class Interruptible final : public record::Source {
 public:
  explicit Interruptible(std::unique_ptr<record::Source> of) : of_(std::move(of)) {}
  [[nodiscard]] std::uint64_t size() const override { return of_->size(); }
  [[nodiscard]] std::string name() const override { return of_->name(); }
  [[nodiscard]] Expected<void> read(std::uint64_t at, std::span<std::byte> into) const override {
    if (interrupted()) return fail(kInterrupted, name());
    return of_->read(at, into);
  }

 private:
  std::unique_ptr<record::Source> of_;
};

Expected<std::unique_ptr<record::Source>> source_of(const fs::path& file) {
  auto source = record::open_file(file);
  if (!source) return source;
  return std::make_unique<Interruptible>(*std::move(source));
}

Expected<std::unique_ptr<McapReader>> reader_of(const fs::path& file) {
  auto source = source_of(file);
  if (!source) return std::unexpected(source.error());
  return McapReader::open(*std::move(source));
}

// A line for a person: what a file says of itself, and its name, must not write to the terminal what it likes.
void tell(std::FILE* out, std::string_view line) { say(out, plain(line) + "\n"); }
void warn(std::string_view line) { tell(stderr, fmt::format("pons: {}", line)); }

std::string megabytes(std::uint64_t bytes) { return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes)); }

double span_s(const mcap::Statistics& statistics) {
  return 1e-9 * static_cast<double>(statistics.end - statistics.start);
}

// "zstd, 40 chunks, 12.0 of 31.5 MB"
std::string compression_of(const record::Contents& contents) {
  std::map<std::string, int> names;
  std::uint64_t compressed = 0, uncompressed = 0;
  for (const auto& each : contents.chunks) {
    ++names[each.compression.empty() ? "uncompressed" : each.compression];
    compressed += each.compressed_size;
    uncompressed += each.uncompressed_size;
  }
  if (names.empty()) return contents.statistics.messages > 0 ? "no chunks" : "empty";
  std::string text;
  for (const auto& [name, count] : names) text += (text.empty() ? "" : " and ") + name;
  const auto chunks = contents.chunks.size();
  text += fmt::format(", {} chunk{}", chunks, chunks == 1 ? "" : "s");
  if (compressed != uncompressed) text += fmt::format(", {} of {}", megabytes(compressed), megabytes(uncompressed));
  return text;
}

// What the recorder said of messages that it could not take; the last words count.
Expected<mcap::Texts> drops_of(const McapReader& reader) {
  const auto& all = reader.contents().metadata;
  const auto last = std::ranges::find(all.rbegin(), all.rend(), record::kDropsName, &mcap::MetadataIndex::name);
  if (last == all.rend()) return mcap::Texts{};
  auto metadata = reader.metadata(*last);
  if (!metadata) return std::unexpected(metadata.error());
  return std::move(metadata->texts);
}

Rows rows_of(const McapReader& reader) {
  const record::Contents& contents = reader.contents();
  Rows rows;
  for (const auto& [id, channel] : contents.channels) {
    const auto found = contents.statistics.channel_messages.find(id);
    const std::string type(contents.type_of(channel));
    rows[{plain(channel.topic), plain(type.empty() ? channel.message_encoding : type)}].messages +=
        found == contents.statistics.channel_messages.end() ? 0 : found->second;
  }
  const auto drops = drops_of(reader);
  // All the rest can be shown without.
  if (!drops) warn(fmt::format("how many were dropped is not known: {}", drops.error().line()));
  for (const auto& [name, count] : drops.value_or(mcap::Texts{})) {
    const std::string topic = plain(name);
    const auto row = std::ranges::find_if(rows, [&](const auto& each) { return each.first.first == topic; });
    auto& dropped = row == rows.end() ? rows[{topic, "-"}].dropped : row->second.dropped;
    dropped = std::strtoull(count.c_str(), nullptr, 10);
  }
  return rows;
}

// Of times since 1970 the date.
std::string moment(mcap::Timestamp time) {
  constexpr mcap::Timestamp kFirstDate = 946'684'800'000'000'000;  // of the year 2000
  const auto seconds = static_cast<std::time_t>(time / 1'000'000'000);
  if (time < kFirstDate) return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(time));
  return fmt::format("{:%F %T} UTC", fmt::gmtime(seconds));
}

// Nothing: it is of no run of Pons, or does not say so in words that this Pons knows.
std::optional<RecordedRun> run_of(const McapReader& reader) {
  auto run = recorded_run(reader);
  return run ? std::optional(*std::move(run)) : std::nullopt;
}

std::string_view pace_of(const RunFacts& facts) {
  return facts.pace == runner::Pace::kRealTime ? "by the clock" : "in virtual time";
}

// Nothing where nobody said how many, or where none came.
std::optional<std::int64_t> parcels_of(const RunFacts& facts) {
  return facts.parcels.value_or(0) > 0 ? facts.parcels : std::nullopt;
}

// "run of parcel_cell, seed 1, 20 parcels, in virtual time: complete"
std::string run_line(const RecordedRun& run) {
  const RunFacts& facts = run.facts;
  const auto count = parcels_of(facts);
  const std::string parcels = count ? fmt::format(", {} parcel{}", *count, *count == 1 ? "" : "s") : "";
  return fmt::format("run of {}, seed {}{}, {}: {}", facts.world, facts.seed, parcels, pace_of(facts),
                     run.ended.empty() ? "its end is not in this file" : run.ended);
}

wire::Json run_json(const RecordedRun& run) {
  const RunFacts& facts = run.facts;
  wire::Json json{{"world", plain(facts.world)}, {"seed", facts.seed}, {"pace", pace_of(facts)}};
  const auto parcels = parcels_of(facts);
  json["parcels"] = parcels ? wire::Json(*parcels) : wire::Json();
  json["ended"] = run.ended.empty() ? wire::Json() : wire::Json(plain(run.ended));
  return json;
}

// Where it is not whole, what is shown is what can be read.
void show_damage(const record::Contents& contents, const std::string& file) {
  if (contents.damage) warn(contents.damage->error(file).line());
}

int show_json(const McapReader& reader, const Rows& rows) {
  const record::Contents& contents = reader.contents();
  wire::Json topics = wire::Json::array();
  for (const auto& [key, row] : rows)
    topics.push_back(
        {{"topic", key.first}, {"type", key.second}, {"messages", row.messages}, {"dropped", row.dropped}});
  const auto run = run_of(reader);
  const wire::Json json{{"file", reader.source().name()},
                        {"bytes", reader.source().size()},
                        {"finished", contents.finished},
                        {"profile", plain(contents.header.profile)},
                        {"library", plain(contents.header.library)},
                        {"run", run ? run_json(*run) : wire::Json()},
                        {"start_ns", contents.statistics.start},
                        {"end_ns", contents.statistics.end},
                        {"messages", contents.statistics.messages},
                        {"chunks", contents.chunks.size()},
                        {"attachments", contents.attachments.size()},
                        {"topics", topics}};
  say(stdout, json.dump(2, ' ', false, wire::Json::error_handler_t::replace) + "\n");
  return kExitGood;
}

void show_rows(const Rows& rows, double took_s) {
  std::size_t topic_width = 5, type_width = 4;
  for (const auto& [key, row] : rows) {
    topic_width = std::max(topic_width, key.first.size());
    type_width = std::max(type_width, key.second.size());
  }
  say(stdout, fmt::format("\n{:<{}}  {:<{}}  {:>10}  {:>8}  {:>8}\n", "topic", topic_width, "type", type_width,
                          "messages", "a second", "dropped"));
  for (const auto& [key, row] : rows) {
    const std::string rate = took_s > 0 ? fmt::format("{:.1f}", static_cast<double>(row.messages) / took_s) : "-";
    say(stdout, fmt::format("{:<{}}  {:<{}}  {:>10}  {:>8}  {:>8}\n", key.first, topic_width, key.second, type_width,
                            row.messages, rate, row.dropped));
  }
}

int info(const RecordingOptions& options) {
  const auto reader = reader_of(options.file);
  if (!reader) return bad_input(reader.error());
  const record::Contents& contents = (*reader)->contents();
  const Rows rows = rows_of(**reader);
  show_damage(contents, options.file.string());
  if (options.json) return show_json(**reader, rows);
  const auto& statistics = contents.statistics;
  tell(stdout, fmt::format("{}: {}, {}", options.file.string(), contents.finished ? "finished" : "not finished",
                           megabytes((*reader)->source().size())));
  if (const auto run = run_of(**reader)) tell(stdout, run_line(*run));
  if (statistics.messages > 0)
    tell(stdout,
         fmt::format("{} to {}, {:.3f} s", moment(statistics.start), moment(statistics.end), span_s(statistics)));
  tell(stdout, fmt::format("{}; written by {}", compression_of(contents),
                           contents.header.library.empty() ? "nobody that says so" : contents.header.library));
  show_rows(rows, span_s(statistics));
  for (const auto& each : contents.attachments)
    tell(stdout, fmt::format("attachment {} ({}, {} bytes)", each.name, each.media_type, each.data_size));
  return kExitGood;
}

std::string held(const record::Verdict& verdict) {
  return fmt::format("{} messages in {} chunks, {} attachments", verdict.messages, verdict.chunks, verdict.attachments);
}

// What the library cannot know: how a person allows it.
int cannot_make(Error error) {
  if (error.mend == record::kAllowIt) error.mend = "choose another name, or give --overwrite";
  return bad_input(error);
}

int check(const RecordingOptions& options) {
  const auto source = source_of(options.file);
  if (!source) return bad_input(source.error());
  const auto verdict = record::check(**source);
  if (!verdict) return bad_input(verdict.error());
  if (verdict->whole()) {
    say(stdout, fmt::format("whole: {}\n", held(*verdict)));
    return kExitGood;
  }
  for (const record::Damage& each : verdict->damage)
    warn(fmt::format("{}: byte {}: {}", options.file.string(), each.at, each.what));
  if (verdict->further > 0) warn(fmt::format("and {} more", verdict->further));
  say(stdout, fmt::format("not whole; can be saved by pons recording repair: {}\n", held(*verdict)));
  return kExitBadRun;
}

int repair(const RecordingOptions& options) {
  const auto source = source_of(options.file);
  if (!source) return bad_input(source.error());
  fs::path output = options.output;
  if (output.empty()) {
    output = options.file;
    output.replace_filename(options.file.stem().string() + "_repaired.mcap");
  }
  if (auto repaired = record::repair(**source, output, options.overwriting()); !repaired)
    return cannot_make(repaired.error());
  const auto made = source_of(output);
  if (!made) return bad_run(made.error());
  const auto verdict = record::check(**made);
  if (!verdict) return bad_run(verdict.error());
  tell(stdout, fmt::format("{}: {}", output.string(), held(*verdict)));
  return kExitGood;
}

int film(const RecordingOptions& options, const McapReader& reader) {
  if (options.topics.size() != 1)
    return bad_input({"a film is of one topic", options.mp4.string(), "name it with --topic"});
  const auto filmed = record::export_mp4(reader, options.topics.front(), options.mp4, options.overwriting());
  if (!filmed) return cannot_make(filmed.error());
  if (filmed->damage) warn(filmed->damage->error(options.file.string()).line());
  say(stdout, fmt::format("{} pictures, {:.2f} a second\n", filmed->pictures, filmed->a_second));
  return filmed->damage ? kExitBadRun : kExitGood;
}

// As a name of a file.
constexpr std::string_view kStandardOutput = "-";
constexpr std::string_view kNobodyReads = "nobody reads it any more";

// Past stdio, which tells of a line some time after it that it could not be written.
Expected<void> write_out(std::string_view lines) {
  while (!lines.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, lines.data(), lines.size());
    // One that reads no more for now must not keep a person waiting who has had enough.
    if (written < 0 && errno == EINTR && interrupted()) return fail(kInterrupted, "the standard output");
    if (written < 0 && errno == EINTR) continue;
    if (written < 0 && errno == EPIPE) return fail(std::string(kNobodyReads), "the standard output");
    if (written < 0)
      return fail(fmt::format("cannot write: {}", std::generic_category().message(errno)), "the standard output",
                  "look after what it is redirected to");
    lines.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

Expected<record::Exported> export_texts(const RecordingOptions& options, const McapReader& reader,
                                        const record::Query& query) {
  if (!options.csv.empty()) return record::export_csv(reader, query, options.csv, options.overwriting());
  if (options.jsonl == kStandardOutput) return record::export_jsonl(reader, query, write_out);
  return record::export_jsonl(reader, query, options.jsonl, options.overwriting());
}

int export_it(const RecordingOptions& options) {
  const auto reader = reader_of(options.file);
  if (!reader) return bad_input(reader.error());
  if (!options.mp4.empty()) return film(options, **reader);
  record::Query query;
  if (!options.topics.empty()) query.topics.emplace(options.topics.begin(), options.topics.end());
  const auto exported = export_texts(options, **reader, query);
  // A reader that has seen enough (head).
  if (!exported && exported.error().what == kNobodyReads) return kExitGood;
  if (!exported) return cannot_make(exported.error());
  for (const auto& [topic, why] : exported->left_out) warn(fmt::format("{} is left out: {}", topic, why));
  if (exported->first_unreadable)
    warn(fmt::format("{} messages left out; the first: {}", exported->unreadable, exported->first_unreadable->line()));
  if (exported->damage) warn(exported->damage->error(options.file.string()).line());
  say(options.jsonl == kStandardOutput ? stderr : stdout, fmt::format("{} messages\n", exported->messages));
  const bool all = exported->unreadable == 0 && !exported->damage && (exported->left_out.empty() || !query.topics);
  return all ? kExitGood : kExitBadRun;
}

// What was done to its end before Ctrl-C came is done.
int unless_interrupted(int (*run)(const RecordingOptions&), const RecordingOptions& options) {
  watch_interrupts();
  const int code = run(options);
  return code != kExitGood && interrupted() ? kExitInterrupted : code;
}

}  // namespace

void add_recording(CLI::App& app, Chosen& chosen) {
  auto options = std::make_shared<RecordingOptions>();
  CLI::App* recording =
      app.add_subcommand("recording", "Look into a recording, check it, mend it, or make tables of it");
  recording->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, int (*run)(const RecordingOptions&)) {
    CLI::App* command = recording->add_subcommand(name, what);
    command->add_option("file", options->file, "An MCAP file, whoever wrote it")->required();
    command->callback(
        [options, run, &chosen] { chosen = [options, run] { return unless_interrupted(run, *options); }; });
    return command;
  };
  CLI::App* shows =
      add("info", "Its topics, types, counts, duration and compression, and whether it was finished", info);
  shows->add_flag("--json", options->json, "The same for programs");
  CLI::App* checks = add("check", "Whether it is whole to the last byte, and what can be saved if not", check);
  CLI::App* mend = add("repair", "Write a whole one of all that can be read of it", repair);
  mend->add_option("--output", options->output, "The new file (FILE_repaired.mcap beside it)");
  mend->add_flag("--overwrite", options->overwrite, "The new file may replace one; also FILE itself");
  CLI::App* tables =
      add("export", "Its messages as text, of the types that Pons knows; or pictures as a film", export_it);
  auto* csv = tables->add_option("--csv", options->csv, "A folder for one table a topic");
  auto* jsonl =
      tables->add_option("--jsonl", options->jsonl, "A file for one JSON object a line; -: the standard output");
  auto* mp4 = tables->add_option("--mp4", options->mp4, "A film of a topic of compressed images, by ffmpeg");
  csv->excludes(jsonl);
  mp4->excludes(csv)->excludes(jsonl);
  for (CLI::App* each : {shows, checks, mend, tables}) refuse_no_values(*each);
  // After that: a topic's name may be empty.
  tables->add_option("--topic", options->topics, "Only this one; may be given several times")->allow_extra_args(false);
  tables->add_flag("--overwrite", options->overwrite, "New files may replace others");
  tables->callback([options, &chosen] {
    if (options->csv.empty() && options->jsonl.empty() && options->mp4.empty())
      throw CLI::RequiredError("pons recording export: --csv DIR, --jsonl FILE or --mp4 FILE");
    chosen = [options] { return unless_interrupted(export_it, *options); };
  });
}

}  // namespace pons::apps
