#include "tests/ros/peer_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <utility>

extern char** environ;

namespace pons::test {

PeerProcess::PeerProcess(const std::string& program, std::uint32_t domain, const std::string& node,
                         const std::string& role, const std::vector<std::string>& environment) {
  std::array<int, 2> to{}, from{};
  if (::pipe2(to.data(), O_CLOEXEC) != 0 || ::pipe2(from.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  input_ = gate::Descriptor(to[1]);
  output_ = gate::Descriptor(from[0]);
  const gate::Descriptor its_input(to[0]), its_output(from[1]);
  ::fcntl(output_.get(), F_SETFL, O_NONBLOCK);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, its_input.get(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, its_output.get(), STDOUT_FILENO);
  std::vector<std::string> words{program, std::to_string(domain), node, role};
  std::vector<char*> arguments, variables;
  for (std::string& word : words) arguments.push_back(word.data());
  std::vector<std::string> added = environment;
  for (std::string& each : added) variables.push_back(each.data());
  for (char** each = environ; *each != nullptr; ++each) variables.push_back(*each);
  arguments.push_back(nullptr);
  variables.push_back(nullptr);
  const int problem = ::posix_spawn(&id_, program.c_str(), &actions, nullptr, arguments.data(), variables.data());
  ::posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) throw std::runtime_error("cannot start " + program);
}

PeerProcess::~PeerProcess() {
  if (id_ < 0) return;
  input_ = gate::Descriptor();  // which ends it, and that what it prints
  pollfd ends{output_.get(), 0, 0};
  (void)::poll(&ends, 1, 3000);
  kill();
}

void PeerProcess::kill() {
  if (id_ < 0) return;
  ::kill(id_, SIGKILL);
  int status = 0;
  ::waitpid(id_, &status, 0);
  id_ = -1;
}

const std::vector<std::string>& PeerProcess::lines() {
  std::array<char, 4096> bytes{};
  for (ssize_t got = 0; (got = ::read(output_.get(), bytes.data(), bytes.size())) > 0;)
    rest_.append(bytes.data(), static_cast<std::size_t>(got));
  for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos;) {
    lines_.push_back(rest_.substr(0, end));
    rest_.erase(0, end + 1);
  }
  return lines_;
}

bool PeerProcess::said(const std::string& start) {
  return std::ranges::any_of(lines(), [&](const std::string& line) { return line.starts_with(start); });
}

}  // namespace pons::test
