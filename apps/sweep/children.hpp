// Other processes, started and ended.
#pragma once

#include <sys/types.h>

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

struct Ended {
  int code = 0;    // of one that ended by itself
  int signal = 0;  // that ended it, else 0
};

// "ended with exit code 3", "was ended by signal 11 (Segmentation fault)".
[[nodiscard]] std::string describe(const Ended& ended);

// One process. Its standard input is empty; the signals that this program ignores or blocks it does not. It goes on
// when this goes, unless it was ended: who starts one waits for it.
class Child {
 public:
  enum class Group : std::uint8_t { kOurs, kOwn };  // kOwn: a terminal's Ctrl-C does not reach it
  struct Start {
    std::vector<std::string> words;  // the program's path first; handed over as they are
    std::filesystem::path output;    // both its streams go there, appended; made if need be
    std::vector<std::pair<std::string, std::string>> environment{};  // beside ours
    Group group = Group::kOurs;
  };
  // Error: it cannot be started.
  [[nodiscard]] static Expected<Child> start(const Start& start);

  // Nothing while it goes on.
  [[nodiscard]] std::optional<Ended> look();
  [[nodiscard]] Ended wait();
  // To it, or of kOwn to all of its group.
  void signal(int number) const;

 private:
  Child(pid_t pid, Group group) : pid_(pid), group_(group) {}

  pid_t pid_;
  Group group_;
  std::optional<Ended> ended_;
};

// While one lives, this thread hears of children and interruptions as soon as they come, by waiting.
class ChildEvents {
 public:
  ChildEvents();
  ~ChildEvents();
  ChildEvents(const ChildEvents&) = delete;
  ChildEvents& operator=(const ChildEvents&) = delete;
  // Until a child has ended, a signal has come, or so long.
  void wait(double longest_s);

 private:
  sigset_t before_{};
};

}  // namespace pons::apps
