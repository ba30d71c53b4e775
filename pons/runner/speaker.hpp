// Speech by espeak-ng, a program of its own: started and awaited on a thread beside the bridge's.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "pons/runner/photographer.hpp"
#include "pons/task/speech.hpp"

namespace pons::runner {

// Speech takes as long as it is heard, after the moment that making it takes. By the clock that moment is as long as it
// is; in lockstep it is modelled, and who asks after it waits for the program, so that its speed decides nothing.
class Speaker final : public task::Speech {
 public:
  // Its files go into `folder`, numbered, which must exist when something is said. `program` is looked for in PATH.
  Speaker(std::filesystem::path folder, Pace pace, std::string program = "espeak-ng");
  // Ends a program that still runs.
  ~Speaker() override;
  Speaker(const Speaker&) = delete;
  Speaker& operator=(const Speaker&) = delete;

  [[nodiscard]] Expected<void> begin(const std::string& text, Time now) override;
  [[nodiscard]] std::optional<Expected<task::Spoken>> look(Time now) override;
  void stop() override;

 private:
  struct Run;
  const std::filesystem::path folder_;
  const Pace pace_;
  const std::string program_;
  int utterances_ = 0;
  Time begun_;
  std::optional<task::Spoken> made_;  // and it is heard now
  std::unique_ptr<Run> run_;
};

// How long a WAV file (RIFF, PCM) sounds. Error: it is none.
[[nodiscard]] Expected<double> wav_length_s(const std::filesystem::path& file);

}  // namespace pons::runner
