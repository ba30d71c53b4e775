// An accepted task without an outcome, as the bridge has it in hand.
#pragma once

#include <set>
#include <string>

#include "pons/bridge/bridge.hpp"

namespace pons::bridge {

// Deadlines that pass at once, and that tasks are held or released, are written by so many a tick: about a fifth of its
// time. A bridge that dies meanwhile leaves to the next what that one finds by itself.
inline constexpr std::size_t kWrittenATick = 64;

struct Bridge::Open {
  // Where it is. Only a task that runs holds resources and is ticked.
  enum class Stage : std::uint8_t {
    kWaits,   // in the arbiter's queue
    kRuns,    // on its way, or paused on it
    kParked,  // paused, or a person is asked about it; out of the queue
    kLeaves,  // out of the queue for good, as `leaves` says
  };
  // By what an allowed use is known again.
  [[nodiscard]] static std::string key(const Leave& leave) { return leave.rule->name + " " + leave.use; }

  // What a running one was told, beside ending.
  enum class Told : std::uint8_t {
    kNothing,
    kPause,    // by a person, or for the bridge to rest: it keeps its resources
    kPreempt,  // for another task: it waits again as soon as it stands
  };

  task::Task task;
  int priority = 50;          // it waits with
  std::int64_t sequence = 0;  // of its acceptance in the journal
  Time accepted;
  std::size_t done = 0;                          // steps that an earlier bridge has seen succeed
  std::shared_ptr<const tree::Program> program;  // of its tree, none of steps; of one sent along not before it starts
  std::vector<std::size_t> robots;     // that may run it, those of the arbiter's ways; one that has begun: one
  std::size_t robot = 0;               // the first of them
  std::vector<std::string> resources;  // with that one
  std::unique_ptr<tree::Tree>
      tree;                       // none before it was granted for the first time, but for one that was begun earlier
  Asked asked;                    // what a person must allow before it begins
  Time asked_since;               // in the arbiter's time, which stands while nothing may start
  std::set<std::string> allowed;  // uses, by key()
  bool unwritten = false;         // a leaf has ended since the last checkpoint
  Stage stage = Stage::kWaits;
  Told told = Told::kNothing;
  bool paused = false;       // by a person, while it is parked
  bool begun = false;        // by this bridge or one before
  bool stands = false;       // as it was told
  bool handed_over = false;  // by this bridge: it stands, and waits to regain its resources
  bool held = false;         // by an emergency stop
  bool cancelled = false, halted = false;
  std::string cancel_reason;
  std::string paused_for;                            // by which it was paused last
  task::Outcome leaves = task::Outcome::kCancelled;  // and why, `cancel_reason`
  int attempts = 0;
  std::size_t events = 0;      // in the journal, about
  Json steps = Json::array();  // what each step that ended had to tell
};

}  // namespace pons::bridge
