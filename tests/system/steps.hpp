// The steps at which a bridge's process may die, be held up, or lose its computer's power: where what it does touches
// the disk, the link, its visitors or a skill. Hooks in what stands in for the world report them; the product knows
// nothing of it.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "pons/core/time.hpp"

namespace pons::tests {

// What the process is at.
enum class Doing : std::uint8_t {
  kOpening,     // its journal
  kTakingOver,  // from the bridge before
  kLooking,     // at the arm's state, leading it out of a stop
  kAnswering,   // visitors
  kTicking,     // tasks, what hangs on the cups, outcomes
  kClosing,     // its journal
  kCompacting,  // likewise, while no bridge runs
};

enum class Act : std::uint8_t {
  kWriteLog,  // of the journal's write-ahead log
  kSyncLog,
  kCutLog,     // or removes it
  kWriteFile,  // of the journal itself, or of what takes its creation back
  kSyncFile,
  kCutFile,
  kHear,       // what visitors ask
  kReply,      // to one
  kHeartbeat,  // to the cerebellum
  kLeadOut,    // of a stop: a reset, or an arming
  kBelt,
  kMotion,
  kCups,
  kPrint,  // the one job that a printer does as soon as it is told
  kStart,  // of a skill
};

enum class Moment : std::uint8_t { kBefore, kAfter };

struct Step {
  Doing doing = Doing::kOpening;
  Act act = Act::kHear;
  Moment moment = Moment::kBefore;
  auto operator<=>(const Step&) const = default;
};

[[nodiscard]] std::string name(const Step& step);  // "answering: before the log is synced"

// Every step that a bridge comes by, as far as whoever draws one to die at is concerned.
[[nodiscard]] std::span<const Step> all_steps();

enum class Fate : std::uint8_t {
  kLives,
  kDies,        // what it has written the next one finds
  kLosesPower,  // and with it the disk what was not synced
  kIsHeldUp,    // for a while, in the middle of what it does
};

// What shall become of one process: at the n-th time that it comes by that step, or by any.
struct Plan {
  Fate fate = Fate::kLives;
  std::optional<Step> at;
  std::int64_t count = 1;
  Duration held_up{0};
};

class Steps {
 public:
  // `held_up` lets the rest of the world go on meanwhile; `gone` is called at the instant in which the process ends.
  Steps(std::function<void(Duration)> held_up, std::function<void(Fate)> gone)
      : held_up_(std::move(held_up)), gone_(std::move(gone)) {}

  // A process begins.
  void begin(const Plan& plan);
  void doing(Doing doing) { doing_ = doing; }
  // The process comes by. False: it is dead, and nothing that it seems to do from here on happens.
  [[nodiscard]] bool at(Act act, Moment moment);
  [[nodiscard]] bool alive() const { return !gone_with_; }
  // How it ended, as long as the next one has not begun.
  [[nodiscard]] std::optional<Fate> gone_with() const { return gone_with_; }
  void kill(Fate fate);

  // At which the last process ended that did so at one; any process was held up so far.
  [[nodiscard]] const std::optional<Step>& last_end() const { return last_end_; }
  [[nodiscard]] bool was_held_up() const { return was_held_up_; }
  // Steps at which a process died or lost its power, and how often.
  [[nodiscard]] const std::map<Step, std::int64_t>& ends() const { return ends_; }
  [[nodiscard]] const std::map<Step, std::int64_t>& passed() const { return passed_; }

 private:
  std::function<void(Duration)> held_up_;
  std::function<void(Fate)> gone_;
  Plan plan_;
  Doing doing_ = Doing::kOpening;
  std::optional<Fate> gone_with_;
  std::optional<Step> last_end_;
  bool held_up_now_ = false, was_held_up_ = false;
  std::map<Step, std::int64_t> ends_, passed_;
};

}  // namespace pons::tests
