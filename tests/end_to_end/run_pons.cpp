#include "tests/end_to_end/run_pons.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace pons::tests {
namespace {

// In the child: becomes the program, with its streams where `out` and `err` lead.
[[noreturn]] void become(const std::string& file, const std::vector<std::string>& arguments,
                         const std::vector<std::string>& environment, int out, int err) {
  for (const std::string& entry : environment) {
    const auto equals = entry.find('=');
    setenv(entry.substr(0, equals).c_str(), entry.substr(equals + 1).c_str(), 1);
  }
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  std::vector<std::string> words{std::filesystem::path(file).filename()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(file.c_str(), argv.data());
  _exit(127);
}

int exit_code(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace

Finished run_program(const std::string& file, const std::vector<std::string>& arguments,
                     const std::vector<std::string>& environment) {
  const Folder folder;
  const std::string out = folder / "out", err = folder / "err";
  const pid_t child = fork();
  if (child == 0) {
    become(file, arguments, environment, open(out.c_str(), O_CREAT | O_WRONLY, 0600),
           open(err.c_str(), O_CREAT | O_WRONLY, 0600));
  }
  const int code = exit_code(child);
  return {code, read_text(out), read_text(err)};
}

Finished run_pons(const std::vector<std::string>& arguments, const std::vector<std::string>& environment) {
  return run_program(PONS_BINARY, arguments, environment);
}

int run_pons_unheard(const std::vector<std::string>& arguments) {
  const int full = open("/dev/full", O_WRONLY | O_CLOEXEC);
  const pid_t child = fork();
  if (child == 0) become(PONS_BINARY, arguments, {}, full, full);
  close(full);
  return exit_code(child);
}

Finished run_pons_and(const std::vector<std::string>& arguments, int lines, const std::function<void(pid_t)>& meanwhile,
                      const std::vector<std::string>& environment) {
  std::array<int, 2> err{};
  if (pipe2(err.data(), O_CLOEXEC) != 0) return {};
  const pid_t child = fork();
  if (child == 0) become(PONS_BINARY, arguments, environment, open("/dev/null", O_WRONLY | O_CLOEXEC), err[1]);
  close(err[1]);
  Finished finished;
  std::array<char, 256> chunk{};
  int wanted = lines;
  for (ssize_t got = 0; (got = read(err[0], chunk.data(), chunk.size())) > 0;) {
    const auto begin = chunk.begin(), end = begin + got;
    const int before = wanted;
    wanted -= static_cast<int>(std::count(begin, end, '\n'));
    if (before > 0 && wanted <= 0) meanwhile(child);
    finished.err.append(begin, end);
  }
  close(err[0]);
  finished.code = exit_code(child);
  return finished;
}

Running::Running(const std::filesystem::path& folder, const std::string& name,
                 const std::vector<std::string>& arguments)
    : out_(folder / (name + ".out")), err_(folder / (name + ".err")), child_(fork()) {
  if (child_ != 0) return;
  become(PONS_BINARY, arguments, {}, open(out_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600),
         open(err_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600));
}

Running::~Running() {
  if (child_ <= 0) return;
  kill(child_, SIGKILL);
  (void)exit_code(child_);
}

void Running::signal(int number) const { kill(child_, number); }

Finished Running::wait() {
  const int code = exit_code(child_);
  child_ = -1;
  return {code, read_text(out_), read_text(err_)};
}

std::string Running::err() const { return read_text(err_); }

Folder::Folder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "pons-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) std::abort();
  path_ = pattern;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

nlohmann::json read_json(const std::filesystem::path& file) { return nlohmann::json::parse(read_text(file)); }

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

}  // namespace pons::tests
