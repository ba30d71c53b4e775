// How far the run is: a bar on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "pons/core/time.hpp"

namespace pons::apps {

class Progress {
 public:
  // `out` is watched for being a terminal.
  Progress(std::FILE* out, std::int64_t total);

  struct Figures {
    Time now;
    std::int64_t done = 0;  // parcels with an outcome
    std::int64_t sorted = 0;
    std::size_t queue = 0;  // tasks waiting
  };
  // Draws when enough has changed; cheap otherwise.
  void show(const Figures& figures);
  // A line of something else, which ends with its line feed; the bar is drawn anew below it.
  void put(std::string_view line);
  // Ends the bar's line.
  void finish();

 private:
  void bar(const Figures& figures, double rate);
  void write(const std::string& text);

  std::FILE* out_;
  std::int64_t total_;
  std::int64_t shown_ = -1;
  std::chrono::steady_clock::time_point began_, drawn_;
  bool terminal_;
};

}  // namespace pons::apps
