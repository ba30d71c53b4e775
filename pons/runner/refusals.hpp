// Which real-time conditions the operating system refuses to the threads of a run. Several ask for the same: each
// refusal is told once.
#pragma once

#include <cstddef>
#include <mutex>
#include <string>
#include <vector>

#include "pons/rt/grant.hpp"
#include "pons/runner/run.hpp"

namespace pons::runner {

class Refusals {
 public:
  // A thread's own, before its first tick: it may wait and allocate.
  void note(const rt::Grant& grant);
  // Hands Watch::refused what it was not told yet. One thread.
  void tell(const Watch& watch);
  // All, in one line; empty when nothing was refused. Any thread.
  [[nodiscard]] std::string line() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> lines_;
  std::size_t told_ = 0;
};

}  // namespace pons::runner
