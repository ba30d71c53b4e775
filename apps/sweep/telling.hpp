// What a sweep says while it goes on, and at its end.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <string>

#include "apps/progress.hpp"
#include "pons/record/sweep.hpp"

namespace pons::apps {

// A bar on a terminal, a line for each run that has ended elsewhere. Runs that are not good are told in full at once.
class SweepProgress {
 public:
  enum class Talk : std::uint8_t { kUsual, kQuiet };
  // `made` of `total` runs were there already; up to `jobs` go on at once.
  SweepProgress(std::FILE* out, Talk talk, std::size_t total, std::size_t made, std::size_t jobs);

  void ended(const record::SweepRun& run);
  void going_on(std::size_t running);
  void put(const std::string& line);
  void finish() { line_.finish(); }

 private:
  [[nodiscard]] double elapsed_s() const;
  // Until all are made, by the pace so far; negative while nothing is known.
  [[nodiscard]] double rest_s(std::size_t running) const;

  StatusLine line_;
  Talk talk_;
  std::size_t total_, made_, jobs_;
  std::size_t ended_ = 0, bad_ = 0, without_ = 0;
  std::chrono::steady_clock::time_point began_;
};

// "2:05", "1:02:03"
[[nodiscard]] std::string clock_text(double seconds);

// A line with what it came to, and for one that is not good how it ended and how to repeat it.
[[nodiscard]] std::string told(const record::SweepRun& run);

// A dozen lines for a person.
[[nodiscard]] std::string summary(const record::Sweep& sweep);

}  // namespace pons::apps
