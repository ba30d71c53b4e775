// Runs the program as a person would, and reads what it left.
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace pons::tests {

struct Finished {
  int code = -1;
  std::string out, err;
};

// `arguments` are handed over as they are, through no shell. `environment` entries ("NAME=value") are added.
[[nodiscard]] Finished run_program(const std::string& file, const std::vector<std::string>& arguments,
                                   const std::vector<std::string>& environment = {});
[[nodiscard]] Finished run_pons(const std::vector<std::string>& arguments,
                                const std::vector<std::string>& environment = {});

// Where whatever it says to a person cannot be written; the exit code.
[[nodiscard]] int run_pons_unheard(const std::vector<std::string>& arguments);

// Calls `meanwhile` as soon as it has written `lines` lines to the error stream, and waits for its end. `out` is left
// empty.
[[nodiscard]] Finished run_pons_and(const std::vector<std::string>& arguments, int lines,
                                    const std::function<void(pid_t)>& meanwhile,
                                    const std::vector<std::string>& environment = {});

// The program at work beside the test, its words in files of `folder`; killed, if need be, when this goes.
class Running {
 public:
  Running(const std::filesystem::path& folder, const std::string& name, const std::vector<std::string>& arguments);
  ~Running();
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  void signal(int number) const;
  // How it ended; code is the signal's number, negated, where one killed it.
  [[nodiscard]] Finished wait();
  [[nodiscard]] std::string err() const;  // so far
  [[nodiscard]] pid_t pid() const { return child_; }

 private:
  std::filesystem::path out_, err_;
  pid_t child_ = -1;
};

// A folder of its own for one test, gone with it.
class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

[[nodiscard]] nlohmann::json read_json(const std::filesystem::path& file);
[[nodiscard]] std::string read_text(const std::filesystem::path& file);
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace pons::tests
