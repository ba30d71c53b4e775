#include "apps/sweep/children.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <string_view>

namespace pons::apps {
namespace {

Ended ended_of(int status) {
  if (WIFSIGNALED(status)) return {.code = 0, .signal = WTERMSIG(status)};
  return {.code = WEXITSTATUS(status), .signal = 0};
}

// What a process is started with, and freed again.
class Setup {
 public:
  explicit Setup(const Child::Start& start) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawnattr_init(&attributes_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, start.output.c_str(), O_WRONLY | O_CREAT | O_APPEND,
                                     0666);
    posix_spawn_file_actions_adddup2(&actions_, STDOUT_FILENO, STDERR_FILENO);
    sigset_t none, usual;
    sigemptyset(&none);
    sigemptyset(&usual);
    for (const int number : {SIGPIPE, SIGXFSZ, SIGINT, SIGTERM, SIGHUP}) sigaddset(&usual, number);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &usual);
    const int group = start.group == Child::Group::kOwn ? POSIX_SPAWN_SETPGROUP : 0;
    posix_spawnattr_setflags(&attributes_, static_cast<short>(POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | group));
  }
  ~Setup() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  Setup(const Setup&) = delete;
  Setup& operator=(const Setup&) = delete;

  [[nodiscard]] int spawn(pid_t& pid, const std::vector<char*>& words, const std::vector<char*>& environment) {
    return posix_spawnp(&pid, words.front(), &actions_, &attributes_, words.data(), environment.data());
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

std::vector<std::string> environment_with(const std::vector<std::pair<std::string, std::string>>& added) {
  std::vector<std::string> entries;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text(*entry);
    const std::string_view name = text.substr(0, text.find('='));
    if (std::ranges::find(added, name, &std::pair<std::string, std::string>::first) == added.end())
      entries.emplace_back(text);
  }
  for (const auto& [name, value] : added) entries.push_back(fmt::format("{}={}", name, value));
  return entries;
}

sigset_t child_signal() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGCHLD);
  return set;
}

}  // namespace

std::string describe(const Ended& ended) {
  if (ended.signal != 0) return fmt::format("was ended by signal {} ({})", ended.signal, strsignal(ended.signal));
  return fmt::format("ended with exit code {}", ended.code);
}

Expected<Child> Child::start(const Start& start) {
  std::vector<std::string> words = start.words, environment = environment_with(start.environment);
  pid_t pid = 0;
  const int refused = Setup(start).spawn(pid, pointers(words), pointers(environment));
  if (refused == 0) return Child(pid, start.group);
  return fail(
      fmt::format("cannot be started: {}", std::strerror(refused)), start.words.front(),
      fmt::format("see that it is there and may be started, and that {} can be written", start.output.string()));
}

std::optional<Ended> Child::look() {
  if (ended_) return ended_;
  int status = 0;
  const pid_t found = waitpid(pid_, &status, WNOHANG);
  if (found == pid_) ended_ = ended_of(status);
  if (found < 0 && errno != EINTR) ended_ = Ended{.code = 127, .signal = 0};  // no child of ours any more
  return ended_;
}

Ended Child::wait() {
  ChildEvents events;
  while (!look()) events.wait(1);
  return *ended_;
}

void Child::signal(int number) const {
  if (!ended_) kill(group_ == Group::kOwn ? -pid_ : pid_, number);
}

ChildEvents::ChildEvents() {
  ::signal(SIGCHLD, SIG_DFL);  // whoever started us may have had it ignored: nobody could be waited for
  const sigset_t set = child_signal();
  sigprocmask(SIG_BLOCK, &set, &before_);
}

ChildEvents::~ChildEvents() { sigprocmask(SIG_SETMASK, &before_, nullptr); }

void ChildEvents::wait(double longest_s) {
  const sigset_t set = child_signal();
  const double whole = std::floor(longest_s);
  const timespec longest{.tv_sec = static_cast<time_t>(whole), .tv_nsec = static_cast<long>(1e9 * (longest_s - whole))};
  (void)sigtimedwait(&set, nullptr, &longest);
}

}  // namespace pons::apps
