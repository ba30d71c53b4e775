#include "apps/run_along.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "apps/run_kit.hpp"

namespace pons::apps {

Expected<RunAlong> RunAlong::begin(const RecordOptions& options, const FoxgloveOptions& viewers, Earlier earlier,
                                   const RunFacts& facts, const world::World& world, const Onlooker* onlooker) {
  RunAlong along;
  along.onlooker_ = onlooker;
  // First: what is refused leaves no recording behind.
  if (viewers.on()) {
    auto foxglove = FoxgloveSink::open(viewers, world.name);
    if (!foxglove) return std::unexpected(foxglove.error());
    along.foxglove_ = *std::move(foxglove);
  }
  if (!options.on()) return along;
  RunFacts recorded = facts;
  recorded.depth = options.depth;
  auto notes = notes_of(recorded, world);
  if (!notes) return std::unexpected(notes.error());
  auto recorder = RunRecorder::open(options, earlier, facts.pace, bytes_of(facts.keep_free_mib), *std::move(notes));
  if (!recorder) return std::unexpected(recorder.error());
  along.recorder_ = *std::move(recorder);
  return along;
}

std::vector<Sink*> RunAlong::sinks() const {
  std::vector<Sink*> sinks;
  if (recorder_) sinks.push_back(recorder_.get());
  if (foxglove_) sinks.push_back(foxglove_.get());
  if (onlooker_ != nullptr) sinks.push_back(onlooker_->sink);
  return sinks;
}

std::vector<gate::Visitors*> RunAlong::visitors() const {
  if (!foxglove_ || foxglove_->visitors() == nullptr) return {};
  return {foxglove_->visitors()};
}

bool RunAlong::asks_to_end() const {
  const bool asked = interrupted() || (onlooker_ != nullptr && onlooker_->breaks_off());
  if (asked && recorder_) recorder_->interrupt();
  return asked;
}

std::vector<std::string> RunAlong::take_warnings() const {
  auto warnings = recorder_ ? recorder_->take_warnings() : std::vector<std::string>{};
  if (foxglove_) std::ranges::move(foxglove_->take_warnings(), std::back_inserter(warnings));
  return warnings;
}

void RunAlong::end(const runner::RunResult& result) const {
  if (recorder_) recorder_->end(result.complete ? "complete" : result.broken_off, result.end);
}

void RunAlong::withdraw() const {
  if (recorder_) recorder_->withdraw();
}

std::string RunAlong::line() const {
  return recorder_ ? fmt::format("recording: {}\n", recorder_->line()) : std::string();
}

}  // namespace pons::apps
