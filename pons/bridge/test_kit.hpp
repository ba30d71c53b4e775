// For the tests of this folder: skills that do what they are told, and folders that go away.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <deque>
#include <filesystem>
#include <memory>
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
  int ticks_after_cancel = 0;  // further kRunning once cancelled
  Progress cancelled_end{Status::kFailed, "broken off", Json::object()};
};

// A skill type that takes its courses one after the other, the last for ever, and remembers what was asked of it.
class Actor {
 public:
  struct Log {
    std::vector<Json> started;
    int ticks = 0, cancels = 0;
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
      if (cancelled_) return left_-- > 0 ? Progress{} : course_.cancelled_end;
      return ++done_ < course_.ticks ? Progress{} : course_.end;
    }
    void cancel(Time) override {
      ++log_.cancels;
      cancelled_ = true;
      left_ = course_.ticks_after_cancel;
    }

   private:
    Course course_;
    Log& log_;
    int done_ = 0, left_ = 0;
    bool cancelled_ = false;
  };

  std::string name_;
  std::deque<Course> courses_;
};

inline Progress ends(Status status, std::string reason = "", Json detail = Json::object()) {
  return {status, std::move(reason), std::move(detail)};
}

}  // namespace pons::bridge
