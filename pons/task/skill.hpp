// What a skill is: a named, typed ability that runs as an explicit state machine, ticked by the bridge.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

enum class Status : std::uint8_t {
  kRunning,
  kSucceeded,
  kRetry,      // did not work this time; the world is safe and trying again may help
  kFailed,     // did not work and will not
  kException,  // handled, but not as asked (an overweight parcel put back): ends the task as EXCEPTION
};

[[nodiscard]] std::string_view name(Status status);  // "running", "succeeded", …

// For the journal, at any tick: what the skill believes, plans, and does.
struct Note {
  std::string kind;  // "plan", "motion"
  Json detail;
};

struct Progress {
  Status status = Status::kRunning;
  std::string reason;            // for everything but kRunning and kSucceeded
  Json detail = Json::object();  // for the journal, when it ends: measured mass, place of the grasp …
  std::vector<Note> notes = {};
};

// One use of a skill. tick() is called every bridge period (10 ms) until it says something else than kRunning.
class Skill {
 public:
  virtual ~Skill() = default;
  [[nodiscard]] virtual Progress tick(Time now) = 0;
  // Leave the world safe, then end; tick() goes on being called until it ends. Does not drop what is held. Ending with
  // kSucceeded then means that the step was done all the same; a step broken off ends with kFailed or kException.
  virtual void cancel(Time now) = 0;
};

struct SkillType {
  std::string name;                    // "pick"
  std::string summary;                 // one line for `pons skills`
  Json schema;                         // JSON schema of the arguments
  std::vector<std::string> resources;  // what it holds while it runs: "arm"
  Duration timeout{0};                 // then it is cancelled and has failed
  int attempts = 1;                    // how often it may be started when it says kRetry
  std::function<std::unique_ptr<Skill>(const Json& arguments, Time now)> start;
};

class SkillRegistry {
 public:
  // Asserts that the name is new.
  void add(SkillType type);
  [[nodiscard]] const SkillType* find(std::string_view name) const;
  [[nodiscard]] const std::map<std::string, SkillType, std::less<>>& all() const { return types_; }

 private:
  std::map<std::string, SkillType, std::less<>> types_;
};

}  // namespace pons::task
