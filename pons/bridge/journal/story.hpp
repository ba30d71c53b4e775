// What the events of one task come to: where it stands, and whether they can have happened in that order.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "pons/bridge/journal/journal.hpp"

namespace pons::bridge {

// Kinds that a bridge notes of a task that runs, apart from kStartedEvent.
inline constexpr std::string_view kAttemptEvent = "attempt";             // {"step","skill","attempt"}: a skill starts
inline constexpr std::string_view kAttemptEndedEvent = "attempt_ended";  // and {"status","reason","detail"}
inline constexpr std::string_view kCancellingEvent = "cancelling";       // {"reason"}
inline constexpr std::string_view kHaltingEvent = "halting";             // {"reason"}
inline constexpr std::string_view kPausingEvent = "pausing";             // {"reason"}: on its way to a safe point
inline constexpr std::string_view kPausedEvent = "paused";               // {"stop"}, of one that has begun
inline constexpr std::string_view kPreemptingEvent = "preempting";       // {"by"}: likewise, for that task
inline constexpr std::string_view kPreemptedEvent = "preempted";         // {"stop"}: and waits again
inline constexpr std::string_view kAskedEvent = "asked";          // {"wanted":[{"rule","tier","use"}],"within_s"}
inline constexpr std::string_view kAllowedEvent = "allowed";      // {"by","tier","uses":["rule use"]}
inline constexpr std::string_view kContinuedEvent = "continued";  // a person's pause is over
inline constexpr std::string_view kRegainedEvent = "regained";    // preempted, it has its resources again
inline constexpr std::string_view kHeldEvent = "held";            // {"cause"}: an emergency stop has come,
inline constexpr std::string_view kReleasedEvent = "released";    // and is over
inline constexpr std::string_view kResumedEvent = "resumed";      // {"step"}: another bridge goes on, with this step
// What the tree of a task remembers (tree/tree.hpp): at the start of each attempt, and when one has ended and the tree
// goes on.
inline constexpr std::string_view kCheckpointEvent = "checkpoint";
// {"step"}: nobody saw this step end, but the world shows that it had succeeded.
inline constexpr std::string_view kFoundDoneEvent = "found_done";

// Whether events of that kind say where a task stands; others only tell of it.
[[nodiscard]] bool tells_state(std::string_view kind);

// Takes one task's events, in the order of their writing.
class Story {
 public:
  // Error: it cannot follow what was taken before: a second acceptance or outcome, a step that starts though it has
  // succeeded, time that runs back. The story is then as it was.
  [[nodiscard]] Expected<void> take(const Event& event);

  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const std::string& robot() const { return robot_; }  // that it runs on; empty where that was not told
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] bool paused() const { return paused_ > 0; }                    // as far as it was asked for
  [[nodiscard]] const std::string& paused_for() const { return paused_for_; }  // the reason
  // Why it was told to end, if it was.
  [[nodiscard]] const std::optional<std::string>& ending() const { return ending_; }
  // What a person was asked for last, and what any has allowed: rule, skill and arguments.
  struct Wanted {
    std::string rule, use;
  };
  [[nodiscard]] const std::vector<Wanted>& wanted() const { return wanted_; }
  [[nodiscard]] const std::set<std::string>& allowed() const { return allowed_; }
  // It was preempted and has not gone on: what it had begun stands at a safe point, with nothing in use.
  [[nodiscard]] bool handed_over() const { return handed_over_ > 0; }
  // So many of its first steps have succeeded; of a tree, none.
  [[nodiscard]] std::size_t done() const { return done_; }
  // The skills that run, a step or leaves of a tree.
  struct Trying {
    Json arguments;  // that it was started with; null where that was not told
    std::int64_t sequence = 0;
  };
  [[nodiscard]] const std::map<std::size_t, Trying>& trying() const { return trying_; }
  // The last; null when there is none.
  [[nodiscard]] const Json& checkpoint() const { return checkpoint_; }
  // Of a tree: beside acceptance, start and checkpoint, the events without which it would come to something else, by
  // their sequences. What is taken next can follow these as it can follow all.
  [[nodiscard]] std::set<std::int64_t> rests_on() const;
  [[nodiscard]] std::size_t length() const { return length_; }  // events that were taken

 private:
  [[nodiscard]] Expected<void> take_acceptance(const Event& event);
  [[nodiscard]] Expected<void> take_attempt(const Event& event);
  [[nodiscard]] Expected<void> take_attempt_end(const Event& event);
  [[nodiscard]] Expected<void> take_found_done(const Event& event);
  [[nodiscard]] Expected<void> take_end(const Event& event);
  void take_asked(const Event& event);
  void take_allowed(const Event& event);

  std::size_t steps_ = 0;
  std::size_t done_ = 0;
  std::string robot_;
  std::map<std::size_t, Trying> trying_;
  Json checkpoint_;
  std::vector<Wanted> wanted_;
  std::set<std::string> allowed_;
  std::set<std::int64_t> allowances_;  // the events that say so
  std::optional<std::string> ending_;
  std::string paused_for_;
  std::int64_t sequence_ = 0, run_ = 0;
  std::size_t length_ = 0;
  Time stamp_;
  std::int64_t paused_ = 0, handed_over_ = 0, told_to_end_ = 0;  // the events that say so; 0: it is not
  bool accepted_ = false, started_ = false, ended_ = false;
  bool is_tree_ = false;
};

// Of an open task that is a tree: drops what its newest checkpoint has taken in, but for the last `keep` events and
// those on which its story rests, and says how many that are. It becomes durable together with what was written before,
// that checkpoint among it. Errors: as of Journal::event().
[[nodiscard]] Expected<void> shorten(Journal& journal, std::string_view id, std::size_t keep, Time now);

// The body that this journal's tasks were for is gone, and another may come. What had begun ends as FAILED, for nobody
// can go on with it or say what became of it; so does what had not, for it was asked of that body and its run's time.
// Orders of the book that had not begun are as good for another body and stay open. A note says that what was noted of
// the body before is so no more. Becomes durable with the next commit(). Error: the journal cannot be read or written.
[[nodiscard]] Expected<void> end_with_body(Journal& journal, Time now);
inline constexpr std::string_view kBodyGoneEvent = "body_gone";  // {"ended": how many tasks}

// Everything that is wrong with a journal, a line each; empty when it is whole: its storage, each task's story, and
// every record's form.
[[nodiscard]] std::vector<std::string> audit(const Journal& journal);

}  // namespace pons::bridge
