// A run's recording: what its views show, in one or several MCAP files. All on the bridge's thread.
//
// In virtual time messages are written as they come, so that equal runs leave equal bytes. By the clock a thread of its
// own writes them, and what it does not keep up with is dropped and counted. A disk that fails ends no run.
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/record/recorder.hpp"
#include "pons/runner/photographer.hpp"

namespace pons::apps {

struct RecordOptions {
  std::filesystem::path file;                 // NAME.mcap; empty: nothing is recorded
  std::uint64_t file_mib = 0, quota_mib = 0;  // 0: one file, however long; all of it is kept
  bool depth = false;                         // pictures of depth, too
  [[nodiscard]] bool on() const { return !file.empty(); }
};
void add_record_options(CLI::App& command, RecordOptions& options);

// What is done where a recording of that name is there already: a run's is refused; a bridge's goes on in further
// files if bridges of the same body have recorded all of it, for it is one run with one clock, and is refused if not.
struct Earlier {
  std::optional<std::uint64_t> body;  // a bridge's
  static const Earlier kRefused;
};
inline constexpr Earlier Earlier::kRefused{};

class RunRecorder final : public Sink {
 public:
  // `keep_free`: bytes that the journal keeps free on its disk; twice as much is left on the recording's, which may be
  // the same. `notes` stand at the beginning of each file. Errors: no name of a recording; one that is there; the quota
  // is too small, or the files are for the notes; those of the recorder.
  [[nodiscard]] static Expected<std::unique_ptr<RunRecorder>> open(const RecordOptions& options, Earlier earlier,
                                                                   runner::Pace pace, std::uint64_t keep_free,
                                                                   std::vector<record::mcap::Metadata> notes);
  // Finishes the file.
  ~RunRecorder() override;
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  [[nodiscard]] Expected<std::size_t> add(const ShownTopic& topic) override;
  [[nodiscard]] bool wants(std::size_t topic) const override { return topic != kNotRecorded; }
  // What comes with a time before that of an earlier message, as from a bridge that follows another, is logged with
  // that one's, and so is what is made ahead of its time; its own is its publish time.
  void put(std::size_t topic, Time now, std::span<const std::byte> message) override;

  [[nodiscard]] std::string_view name() const override { return "recording"; }
  [[nodiscard]] bool is_live() const override { return false; }
  [[nodiscard]] SinkHealth health() const override;

  // A person breaks the run off; the first time counts.
  void interrupt();
  // The run is over: nothing more is put. `how`: "complete", or why not.
  void end(std::string_view how, Time now);
  // It never began: the file goes again.
  void withdraw();

  // What people should know at once, a line each: recording has stopped, or goes on.
  [[nodiscard]] std::vector<std::string> take_warnings();
  // What it came to, after end(): "F.mcap: 1200 messages, 3.4 MB; 17 dropped: …", or "F_2.mcap to F_4.mcap: …", the
  // files that it has written and that are there.
  [[nodiscard]] std::string line() const;

 private:
  static constexpr std::size_t kNotRecorded = ~std::size_t{0};
  struct Known {
    std::string type;
    record::TopicId id = 0;
  };

  RunRecorder(std::unique_ptr<record::Recorder> recorder, const RecordOptions& options, runner::Pace pace);
  void close();

  std::unique_ptr<record::Recorder> recorder_;
  std::filesystem::path file_;
  bool depth_;
  runner::Pace pace_;
  std::map<std::string, Known> topics_;  // by name
  std::vector<bool> ahead_;              // by TopicId
  Time latest_;
  std::optional<Time> interrupted_;
  Time looks_at_;         // when it is next asked how the recorder fares
  bool failing_ = false;  // as was told
  bool closed_ = false;
  std::thread writes_;  // by the clock only
};

// The metadata with which each file of a bridge's recording begins; its key: life, the body's number.
inline constexpr std::string_view kBodyName = "pons.body";

// The metadata with which a recording says how its run ended; its keys: how ("complete", or why not), end_ns, and
// interrupted_ns, when a person broke it off.
inline constexpr std::string_view kEndName = "pons.end";

// How a topic of a run is called in a recording: that of the node /pons. Error: no name.
[[nodiscard]] Expected<std::string> recorded_name(std::string_view topic);

}  // namespace pons::apps
