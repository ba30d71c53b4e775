#include "apps/run_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "apps/commands.hpp"
#include "pons/gate/ros/names.hpp"
#include "pons/wire/schema.hpp"

namespace pons::apps {
namespace {

namespace fs = std::filesystem;
namespace mcap = record::mcap;

constexpr std::string_view kEnding = ".mcap";
constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
constexpr std::uint64_t kFilesOfQuota = 8;
constexpr std::size_t kQueueBytes = std::size_t{32} << 20U;
constexpr std::uint64_t kKeptFree = 2;  // times what the journal keeps: it goes on when the recording has stopped
constexpr Duration kLooksEvery = std::chrono::seconds(1);
constexpr std::size_t kAllKept = 1000;  // where a publisher keeps all, for players

mcap::Timestamp stamp(Time time) { return static_cast<mcap::Timestamp>(std::max<std::int64_t>(0, time.ns())); }

record::OfferedQos offered(const gate::ros::Qos& qos) {
  using gate::ros::Qos;
  return {qos.reliability == Qos::Reliability::kReliable ? record::Reliability::kReliable
                                                         : record::Reliability::kBestEffort,
          qos.durability == Qos::Durability::kTransientLocal ? record::Durability::kTransientLocal
                                                             : record::Durability::kVolatile,
          qos.depth == 0 ? kAllKept : static_cast<std::size_t>(qos.depth)};
}

record::Topic topic_of(const ShownTopic& shown, std::string name) {
  record::Topic topic{std::move(name), wire::wire_name(shown.type),
                      "ros2msg",       wire::ros2msg_schema(shown.type),
                      "cdr",           {{"offered_qos_profiles", record::offered_qos_profiles(offered(shown.qos))}}};
  if (topic.type == shown.type) topic.metadata.emplace("topic_type_hash", shown.hash);
  topic.latched = shown.qos.durability == gate::ros::Qos::Durability::kTransientLocal && shown.qos.depth == 1;
  return topic;
}

std::uint64_t mib_of(std::uint64_t bytes) { return (bytes + kMiB - 1) / kMiB; }

Expected<record::RecorderOptions> recorder_options(const RecordOptions& options, runner::Pace pace,
                                                   std::uint64_t keep_free, std::span<const mcap::Metadata> notes) {
  const std::string where = "--record " + options.file.string();
  if (options.file.extension() != kEnding || options.file.stem().empty())
    return fail("is no name of a recording", where, "let it end with .mcap");
  record::RecorderOptions made{.folder = options.file.parent_path(), .name = options.file.stem().string()};
  made.first = record::FirstFile::kPlain;
  made.queue_bytes = kQueueBytes;
  made.file_bytes = ~std::uint64_t{0};
  // Notes are repeated in each file, and half of it is for what is new.
  const std::uint64_t noted = record::size_of(notes), least_mib = mib_of(2 * noted);
  if (options.quota_mib > 0) {
    made.quota_bytes = options.quota_mib * kMiB;
    made.file_bytes = std::max({kMiB, *made.quota_bytes / kFilesOfQuota, least_mib * kMiB});
  }
  if (options.file_mib > 0) made.file_bytes = options.file_mib * kMiB;
  if (options.file_mib > 0 && options.file_mib < least_mib)
    return fail(fmt::format("each file begins with what its run was made of, {} KiB, which is more than half of it",
                            (noted + 1023) / 1024),
                fmt::format("--record-file {}", options.file_mib), fmt::format("ask for {} at least", least_mib));
  if (made.quota_bytes && *made.quota_bytes / 2 < made.file_bytes)
    return fail("is less than two files take", fmt::format("--record-quota {}", options.quota_mib),
                fmt::format("ask for {} at least", 2 * mib_of(made.file_bytes)));
  made.keep_free_bytes = kKeptFree * keep_free;
  made.writer.compression = mcap::Compression::kZstd;
  // The disk decides nothing in virtual time, nor does the loss of power matter much to it.
  if (pace == runner::Pace::kRealTime) made.writer.sync_every = std::chrono::seconds(1);
  return made;
}

}  // namespace

void add_record_options(CLI::App& command, RecordOptions& options) {
  auto* const file =
      command.add_option("--record", options.file, "MCAP file for all that the run shows: docs/recording.md");
  command
      .add_option("--record-file", options.file_mib,
                  "Go on in another file after so many MiB: NAME_1.mcap, NAME_2.mcap …; 1 to 1000000 (one file)")
      ->check(whole_number(1, 1'000'000))
      ->needs(file);
  command
      .add_option("--record-quota", options.quota_mib,
                  "Keep no more than the newest files of so many MiB together; 2 to 1000000 (all)")
      ->check(whole_number(2, 1'000'000))
      ->needs(file);
  command.add_flag("--record-depth", options.depth, "Pictures of depth, too: several times as large a recording")
      ->needs(file);
}

Expected<std::string> recorded_name(std::string_view topic) { return gate::ros::expanded(topic, {"/", "pons"}, {}); }

Expected<std::unique_ptr<RunRecorder>> RunRecorder::open(const RecordOptions& options, Earlier earlier,
                                                         runner::Pace pace, std::uint64_t keep_free,
                                                         std::vector<mcap::Metadata> notes) {
  auto made = recorder_options(options, pace, keep_free, notes);
  if (!made) return std::unexpected(made.error());
  made->notes = std::move(notes);
  if (earlier.body) {
    made->series = mcap::Metadata{std::string(kBodyName), {{"life", fmt::format("{:016x}", *earlier.body)}}};
  } else {
    const auto there = record::Rotation::open(made->folder, made->name, made->first);
    if (!there) return std::unexpected(there.error());
    if (!there->at_first())
      return fail("there is a recording of that name already", options.file.string(),
                  "name another file for --record, or move its files away");
  }
  auto recorder = record::Recorder::open(*std::move(made));
  if (!recorder) return std::unexpected(recorder.error());
  return std::unique_ptr<RunRecorder>(new RunRecorder(*std::move(recorder), options, pace));
}

RunRecorder::RunRecorder(std::unique_ptr<record::Recorder> recorder, const RecordOptions& options, runner::Pace pace)
    : recorder_(std::move(recorder)), file_(options.file), depth_(options.depth), pace_(pace) {
  if (pace_ == runner::Pace::kRealTime) writes_ = std::thread([this] { recorder_->work(); });
}

RunRecorder::~RunRecorder() { close(); }

Expected<std::size_t> RunRecorder::add(const ShownTopic& topic) {
  if (!is_recorded(topic.audience, depth_)) return kNotRecorded;
  auto name = recorded_name(topic.name);
  if (!name) return std::unexpected(name.error());
  const std::string type(topic.type);
  if (const auto known = topics_.find(*name); known != topics_.end()) {
    if (known->second.type != type)
      return fail(fmt::format("is {} and {}", known->second.type, type), *name, "give one of them another name");
    return known->second.id;
  }
  const record::TopicId id = recorder_->add_topic(topic_of(topic, *name));
  topics_.emplace(*std::move(name), Known{type, id});
  ahead_.push_back(topic.is_ahead());
  return id;
}

void RunRecorder::put(std::size_t topic, Time now, std::span<const std::byte> message) {
  if (topic == kNotRecorded) return;
  if (!ahead_[topic]) latest_ = std::max(latest_, now);
  (void)recorder_->record(static_cast<record::TopicId>(topic), stamp(latest_), stamp(now), message);
  if (pace_ == runner::Pace::kLockstep) (void)recorder_->work_off();
}

SinkHealth RunRecorder::health() const {
  SinkHealth health;
  for (const record::TopicStatus& topic : recorder_->status().topics) health.dropped += topic.dropped;
  return health;
}

void RunRecorder::interrupt() {
  if (!interrupted_) interrupted_ = latest_;
}

void RunRecorder::end(std::string_view how, Time now) {
  mcap::Metadata end{std::string(kEndName), {{"how", std::string(how)}, {"end_ns", fmt::format("{}", now.ns())}}};
  if (interrupted_) end.texts.emplace("interrupted_ns", fmt::format("{}", interrupted_->ns()));
  (void)recorder_->note(std::move(end));
  close();
}

void RunRecorder::withdraw() {
  close();
  std::error_code ignored;
  fs::remove(recorder_->status().file, ignored);
}

void RunRecorder::close() {
  if (std::exchange(closed_, true)) return;
  recorder_->close();
  if (writes_.joinable()) {
    writes_.join();
  } else {
    recorder_->work();
  }
}

std::vector<std::string> RunRecorder::take_warnings() {
  if (latest_ < looks_at_) return {};
  looks_at_ = latest_ + kLooksEvery;
  const record::RecorderStatus status = recorder_->status();
  if (status.failing == failing_) return {};
  failing_ = status.failing;
  if (!failing_) return {"recording goes on in " + status.file.string()};
  return {fmt::format("recording has stopped: {}; the run goes on, and it is tried again",
                      status.error ? status.error->line() : "")};
}

std::string RunRecorder::line() const {
  const record::RecorderStatus status = recorder_->status();
  std::uint64_t written = 0, dropped = 0;
  std::string of;
  for (const record::TopicStatus& topic : status.topics) {
    written += topic.offered - topic.dropped;
    dropped += topic.dropped;
    if (topic.dropped > 0) of += fmt::format("{}{} of {}", of.empty() ? "" : ", ", topic.dropped, topic.name);
  }
  const auto& [files, bytes, first, last] = status.kept;
  std::string line = files > 0 ? first.string() : file_.string();
  if (files > 1) line += fmt::format(" to {}", last.filename().string());
  line += fmt::format(": {} messages, {:.1f} MB", written, 1e-6 * static_cast<double>(bytes));
  if (files > 1) line += fmt::format(" in {} files", files);
  if (status.removed > 0) line += fmt::format(", {} older ones removed", status.removed);
  if (dropped > 0) line += fmt::format("; {} dropped: {}", dropped, of);
  if (status.error) line += fmt::format("; at last: {}", status.error->line());
  return line;
}

}  // namespace pons::apps
