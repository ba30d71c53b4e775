#include "pons/runner/speaker.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <thread>
#include <utility>
#include <vector>

namespace pons::runner {
namespace {

namespace fs = std::filesystem;

constexpr Duration kMade = std::chrono::milliseconds(100);  // in lockstep
constexpr std::chrono::seconds kLongest{20};                // the program takes milliseconds
constexpr std::chrono::milliseconds kLook{5};

// Starts the program; a pid, or why not.
Expected<pid_t> start(const std::string& program, const fs::path& file, const std::string& text) {
  std::vector<std::string> words{program, "-w", file.string(), "--", text};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t pid = 0;
  const int refused = posix_spawnp(&pid, program.c_str(), nullptr, nullptr, arguments.data(), environ);
  if (refused == 0) return pid;
  return fail(fmt::format("cannot be started: {}", std::strerror(refused)), program,
              "install the package espeak-ng; pons doctor tries it");
}

}  // namespace

// One program and the thread that waits for it.
struct Speaker::Run {
  std::promise<Expected<task::Spoken>> promise;
  std::future<Expected<task::Spoken>> result = promise.get_future();
  std::jthread thread;  // last: it uses the others

  void wait_for(const std::stop_token& stop, const std::string& program, const fs::path& file,
                const std::string& text) {
    const auto pid = start(program, file, text);
    if (!pid) return promise.set_value(std::unexpected(pid.error()));
    const auto end = std::chrono::steady_clock::now() + kLongest;
    int status = 0;
    for (;;) {
      const pid_t ended = waitpid(*pid, &status, WNOHANG);
      if (ended == *pid || (ended < 0 && errno != EINTR)) break;
      if (stop.stop_requested() || std::chrono::steady_clock::now() > end) kill(*pid, SIGKILL);
      std::this_thread::sleep_for(kLook);
    }
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      return promise.set_value(fail("ended without having spoken", program, "try it by hand; pons doctor does"));
    const auto length_s = wav_length_s(file);
    if (!length_s) return promise.set_value(std::unexpected(length_s.error()));
    // Its name alone: the folder may be one of this run only, and equal runs say the same.
    promise.set_value(task::Spoken{file.filename().string(), *length_s});
  }
};

Speaker::Speaker(fs::path folder, Pace pace, std::string program)
    : folder_(std::move(folder)), pace_(pace), program_(std::move(program)) {}

Speaker::~Speaker() = default;

Expected<void> Speaker::begin(const std::string& text, Time now) {
  if (run_) return fail("it speaks already", "speak", "wait until it has ended");
  begun_ = now;
  run_ = std::make_unique<Run>();
  const fs::path file = folder_ / fmt::format("speech_{:03}.wav", ++utterances_);
  run_->thread = std::jthread([run = run_.get(), program = program_, file, text](const std::stop_token& stop) {
    run->wait_for(stop, program, file, text);
  });
  return {};
}

std::optional<Expected<task::Spoken>> Speaker::look(Time now) {
  if (!run_) return fail("nothing is said", "speak");
  if (!made_) {
    const bool waits = pace_ == Pace::kLockstep;
    if (waits && now < begun_ + kMade) return std::nullopt;
    if (!waits && run_->result.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
    auto made = run_->result.get();
    if (!made) {
      run_.reset();
      return std::unexpected(made.error());
    }
    made_ = std::move(*made);
    begun_ = waits ? begun_ + kMade : now;
  }
  if (now < begun_ + from_s(made_->length_s)) return std::nullopt;
  run_.reset();
  return std::exchange(made_, std::nullopt).value();
}

void Speaker::stop() {
  run_.reset();
  made_.reset();
}

Expected<double> wav_length_s(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const auto bad = [&] { return fail("is no WAV file", file.string(), "see what espeak-ng wrote there"); };
  const auto number = [&] {
    std::array<unsigned char, 4> bytes{};
    in.read(reinterpret_cast<char*>(bytes.data()), 4);
    return static_cast<std::uint32_t>(bytes[0] | (bytes[1] << 8U) | (bytes[2] << 16U)) |
           (std::uint32_t{bytes[3]} << 24U);
  };
  std::string word(4, '\0');
  if (!in.read(word.data(), 4) || word != "RIFF") return bad();
  (void)number();
  if (!in.read(word.data(), 4) || word != "WAVE") return bad();
  std::uint32_t bytes_a_second = 0;
  while (in.read(word.data(), 4)) {
    const std::uint32_t size = number();
    if (word == "data") {
      if (bytes_a_second == 0 || !in) return bad();
      return static_cast<double>(size) / bytes_a_second;
    }
    const auto next = in.tellg() + static_cast<std::streamoff>(size + size % 2);
    if (word == "fmt ") {
      (void)number();  // format and channels
      (void)number();  // samples a second
      bytes_a_second = number();
    }
    in.seekg(next);
  }
  return bad();
}

}  // namespace pons::runner
