// How far the run is: a bar on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "pons/core/time.hpp"

namespace pons::apps {

// A line that is drawn anew as things go on, and other lines above it.
class StatusLine {
 public:
  // `out` is watched for being a terminal; elsewhere nothing is drawn.
  explicit StatusLine(std::FILE* out);
  [[nodiscard]] bool terminal() const { return terminal_; }
  // At most ten times a second; says whether it was.
  bool draw(std::string_view text);
  // A line of something else, which ends with its line feed; what is drawn next stands below it.
  void put(std::string_view line);
  // Ends the line that is drawn.
  void finish();

 private:
  std::FILE* out_;
  bool terminal_, drawn_ = false;
  std::chrono::steady_clock::time_point drawn_at_;
};

class Progress {
 public:
  Progress(std::FILE* out, std::int64_t total);

  struct Figures {
    Time now;
    std::int64_t done = 0;  // parcels with an outcome
    std::int64_t sorted = 0;
    std::size_t queue = 0;  // tasks waiting
  };
  // Draws when enough has changed; cheap otherwise.
  void show(const Figures& figures);
  void put(std::string_view line) { line_.put(line); }
  void finish() { line_.finish(); }

 private:
  [[nodiscard]] std::string bar(const Figures& figures, double rate, double wall_s) const;

  StatusLine line_;
  std::int64_t total_;
  std::int64_t shown_ = -1;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace pons::apps
