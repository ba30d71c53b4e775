// What a skill is: a named, typed ability that runs as an explicit state machine, ticked by the bridge.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

enum class Status : std::uint8_t {
  kRunning,
  kPaused,  // runs, but stands at a safe point until it is told to go on
  kSucceeded,
  kRetry,      // did not work this time; the world is safe and trying again may help
  kFailed,     // did not work and will not
  kException,  // handled, but not as asked (an overweight parcel put back): ends the task as EXCEPTION
};

[[nodiscard]] std::string_view name(Status status);  // "running", "succeeded", …
[[nodiscard]] constexpr bool is_end(Status status) { return status != Status::kRunning && status != Status::kPaused; }

// What telling something to stop has come to, by measurement.
enum class StopResult : std::uint8_t {
  kConfirmed,  // it stands, or it is nothing that moves
  kUncertain,  // it should, but that could not be measured
  kFailed,     // it does not
};

[[nodiscard]] std::string_view name(StopResult result);  // "CONFIRMED", …

// What a pause is for.
enum class Pause : std::uint8_t {
  kStand,     // a person wants it to wait: it stops at the next safe point and keeps what it holds
  kHandOver,  // somebody else needs its resources: it stops at the next safe point at which none is in use
};

// For the journal, at any tick: what the skill believes, plans, and does.
struct Note {
  std::string kind;  // "plan", "motion"
  Json detail;
};

struct Progress {
  Status status = Status::kRunning;
  std::string reason;            // for what ends otherwise than with kSucceeded
  Json detail = Json::object();  // for the journal, when it ends: measured mass, place of the grasp …
  std::vector<Note> notes = {};
  std::optional<StopResult> stop = {};  // of kPaused, and of an end that cancel() or halt() has brought about
};

// One use of a skill. tick() is called every bridge period (10 ms) until it says something else than kRunning or
// kPaused. The other verbs may be called at any time before that, in any order; each replaces the one before it, but
// nothing replaces cancel() but halt().
class Skill {
 public:
  virtual ~Skill() = default;
  [[nodiscard]] virtual Progress tick(Time now) = 0;
  // Stop at the next safe point (SkillType::safe_points) and keep the plan: tick() says kPaused from there on. A skill
  // that comes to its end before one ends. Paused for kHandOver it is not ticked until resume(), and anything may have
  // moved meanwhile what it moves.
  virtual void pause(Time now, Pause pause) = 0;
  virtual void resume(Time now) = 0;
  // Leave the world safe, then end; tick() goes on being called until it ends. Does not drop what is held. Ending with
  // kSucceeded then means that the step was done all the same; a step broken off ends with kFailed or kException.
  virtual void cancel(Time now) = 0;
  // Now: whatever moves is stopped where it is, and the skill ends as kFailed once that stands.
  virtual void halt(Time now) = 0;
};

// When a use of a skill is looked at. The world may change in between: what is not known yet is not held against a task
// before its skill starts.
enum class Moment : std::uint8_t {
  kAdmission,
  kStart,
};

// Whether a robot could take up now what a use of a skill is about: on a belt things pass by one robot after the other.
enum class Chance : std::uint8_t { kNotYet, kNow, kGone };

struct SkillType {
  std::string name;                       // "pick"
  std::string summary;                    // one line for `pons skills`
  Json schema;                            // JSON schema of the arguments
  std::vector<std::string> resources;     // what it holds while it runs: "arm"
  Duration timeout{0};                    // then it is cancelled and has failed
  int attempts = 1;                       // how often it may be started when it says kRetry
  std::vector<std::string> outputs = {};  // what of the detail it succeeds with a tree may take up: "mass_kg"
  std::vector<std::string> safe_points;   // where a pause stops it, for a person to read
  // Whether the robot can do it, as far as that is known: reach, what stands in the way, drives. None: it can. Error:
  // why not. Quick: it is asked within a tick of the bridge.
  std::function<Expected<void>(const Json& arguments, Moment moment)> feasible = {};
  // What a use with these arguments holds beside `resources`. Null: whatever one may. None: nothing.
  std::function<std::vector<std::string>(const Json& arguments)> holds = {};
  // Asked where several robots have the skill, each tick while a task waits for one of them. None: any time.
  std::function<Chance(const Json& arguments)> chance = {};
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
