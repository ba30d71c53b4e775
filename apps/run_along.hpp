// Who goes along with a run beside those that it shows itself to live: its recording, viewers, and an onlooker that may
// end it.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "apps/foxglove_sink.hpp"
#include "apps/run_facts.hpp"
#include "apps/run_recorder.hpp"
#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/runner/run.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct Onlooker {
  Sink* sink = nullptr;
  std::function<bool()> breaks_off;  // in each period: whether the run is to end now, as by Ctrl-C
};

class RunAlong {
 public:
  // Begins the recording, where one is asked for, and listens for viewers, where they may look. Errors: those of
  // RunRecorder::open, notes_of and FoxgloveSink::open.
  [[nodiscard]] static Expected<RunAlong> begin(const RecordOptions& options, const FoxgloveOptions& viewers,
                                                Earlier earlier, const RunFacts& facts, const world::World& world,
                                                const Onlooker* onlooker);
  [[nodiscard]] std::vector<Sink*> sinks() const;
  // Who may ask for something.
  [[nodiscard]] std::vector<gate::Visitors*> visitors() const;
  // For runner::Watch::interrupted.
  [[nodiscard]] bool asks_to_end() const;
  // What people should know at once, a line each.
  [[nodiscard]] std::vector<std::string> take_warnings() const;
  // The run is over, and shows nothing more.
  void end(const runner::RunResult& result) const;
  // It could not begin: the recording goes again.
  void withdraw() const;
  // After the end, for the summary: "recording: …", with its line feed; empty: there is none.
  [[nodiscard]] std::string line() const;
  [[nodiscard]] const Onlooker* onlooker() const { return onlooker_; }

 private:
  std::unique_ptr<RunRecorder> recorder_;
  std::unique_ptr<FoxgloveSink> foxglove_;
  const Onlooker* onlooker_ = nullptr;
};

}  // namespace pons::apps
