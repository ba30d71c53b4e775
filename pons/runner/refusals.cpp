#include "pons/runner/refusals.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>

namespace pons::runner {

void Refusals::note(const rt::Grant& grant) {
  const std::lock_guard lock(mutex_);
  for (const std::string& refused : grant.refused) {
    if (std::ranges::find(lines_, refused) == lines_.end()) lines_.push_back(refused);
  }
}

void Refusals::tell(const Watch& watch) {
  std::vector<std::string> fresh;
  {
    const std::lock_guard lock(mutex_);
    fresh.assign(lines_.begin() + static_cast<std::ptrdiff_t>(told_), lines_.end());
    told_ = lines_.size();
  }
  // Without the lock: who is told may wait for a terminal.
  for (const std::string& refused : fresh) {
    if (watch.refused) watch.refused(refused);
  }
}

std::string Refusals::line() const {
  const std::lock_guard lock(mutex_);
  return fmt::format("{}", fmt::join(lines_, "; "));
}

}  // namespace pons::runner
