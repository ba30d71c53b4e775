// For the tests of this folder: skills that do what they are told, and folders that go away.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/task/skill.hpp"

namespace pons::bridge {

using task::Json;
using task::Progress;
using task::Status;

inline Time at(double seconds) { return Time(from_s(seconds)); }

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "pons-XXXXXX").string();
    EXPECT_NE(::mkdtemp(name.data()), nullptr);
    path_ = name;
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

// How one use of a skill goes.
struct Course {
  int ticks = 1;  // says kRunning until this one
  Progress end{Status::kSucceeded, "", Json::object()};
  int ticks_after_cancel = 0;                  // further kRunning once cancelled, and before it stands when paused
  std::optional<task::Pause> stands_for = {};  // paused for anything else, it runs on
  task::StopResult stop = task::StopResult::kConfirmed;
  Progress cancelled_end{Status::kFailed, "broken off", Json::object()};
};

// A skill type that takes its courses one after the other, the last for ever, and remembers what was asked of it.
class Actor {
 public:
  struct Log {
    std::vector<Json> started;
    int ticks = 0, cancels = 0, halts = 0;
    std::vector<task::Pause> pauses;
    int resumes = 0;
  };

  Actor(std::string name, std::vector<Course> courses)
      : name_(std::move(name)), courses_(courses.begin(), courses.end()) {}

  [[nodiscard]] task::SkillType type(int attempts = 1, Duration timeout = from_s(10)) {
    return {.name = name_,
            .summary = "for tests",
            .schema = Json::parse(R"({"type":"object","additionalProperties":false,
                                      "properties":{"object":{"type":"string"}}})"),
            .resources = {"arm"},
            .timeout = timeout,
            .attempts = attempts,
            .outputs = {"mass_kg"},
            .start = [this](const Json& arguments, Time) {
              log.started.push_back(arguments);
              const Course course = courses_.front();
              if (courses_.size() > 1) courses_.pop_front();
              return std::make_unique<Use>(course, log);
            }};
  }

  Log log;

 private:
  class Use final : public task::Skill {
   public:
    Use(Course course, Log& log) : course_(std::move(course)), log_(log) {}
    Progress tick(Time) override {
      ++log_.ticks;
      if (halted_) return stopped({Status::kFailed, "halted"});
      if (cancelled_) return left_-- > 0 ? Progress{} : stopped(course_.cancelled_end);
      if (paused_) return left_-- > 0 ? Progress{} : stopped({Status::kPaused});
      return ++done_ < course_.ticks ? Progress{} : course_.end;
    }
    void pause(Time, task::Pause pause) override {
      log_.pauses.push_back(pause);
      if (pause != course_.stands_for.value_or(pause)) return;
      paused_ = true;
      left_ = course_.ticks_after_cancel;
    }
    void resume(Time) override {
      ++log_.resumes;
      paused_ = false;
    }
    void halt(Time) override {
      ++log_.halts;
      halted_ = true;
    }
    void cancel(Time) override {
      ++log_.cancels;
      cancelled_ = true;
      left_ = course_.ticks_after_cancel;
    }

   private:
    [[nodiscard]] Progress stopped(Progress progress) const {
      progress.stop = course_.stop;
      return progress;
    }

    Course course_;
    Log& log_;
    int done_ = 0, left_ = 0;
    bool cancelled_ = false, paused_ = false, halted_ = false;
  };

  std::string name_;
  std::deque<Course> courses_;
};

inline Progress ends(Status status, std::string reason = "", Json detail = Json::object()) {
  return {status, std::move(reason), std::move(detail)};
}

}  // namespace pons::bridge
