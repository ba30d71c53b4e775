// What must be so, whatever happened on the way: what senders heard, what the plant's truth is and what the journal
// says are one story.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "pons/bridge/journal/journal.hpp"
#include "pons/link/message.hpp"
#include "pons/task/task.hpp"
#include "tests/system/network.hpp"
#include "tests/system/plant.hpp"

namespace pons::tests {

// What a journal holds of each ended task: all, or, once it was compacted, of some only acceptance and outcome.
enum class Kept : std::uint8_t { kAll, kEnds };

class Referee {
 public:
  explicit Referee(std::function<void(const std::string&)> wrong) : wrong_(std::move(wrong)) {}

  // ---- what senders and people hear and say ----
  void accepted(const std::string& id, const Json& task);
  void ended(const std::string& id, task::Outcome outcome);
  void told_to_end(const std::string& id) { told_to_end_.insert(id); }
  // The bridge has heard a person ask for that.
  void person_resets(Time now) { reset_at_ = now; }
  void person_arms(Time now) { armed_at_ = now; }
  // And was told that the arm stops.
  void person_has_stopped(Time now) { stopped_at_ = now; }

  // ---- the arm, every period ----
  struct Glance {
    Time now;
    const link::State& loop;
    const Plant& plant;
    std::optional<Time> bridge_gone;  // since when there is none
  };
  void watch(const Glance& glance);

  // ---- what hangs on the cups, when a bridge has taken over ----
  // By its code, empty when nothing does: what the one before knew after its last whole tick, and what this one knows.
  void takes_up(const std::string& known, const std::string& knows, const Plant& plant);

  // ---- the journal ----
  // While tasks may be open, of a journal that a bridge opens or has closed; and before one is compacted, for what it
  // drops then nobody sees again.
  void look(const bridge::Journal& journal);
  // When all has ended.
  void close(const bridge::Journal& journal, const Plant& plant);
  // Whether the outcome of everything that was heard to be accepted was heard.
  [[nodiscard]] bool all_heard() const;
  [[nodiscard]] std::size_t heard() const { return accepted_.size(); }
  [[nodiscard]] const std::map<std::string, task::Outcome>& outcomes() const { return ended_; }

 private:
  void check_told(const bridge::Journal& journal);
  void check_endings(const bridge::Journal& journal);
  void check_story(const bridge::TaskHistory& task);
  void check_parcels(const std::vector<bridge::TaskHistory>& tasks, const Plant& plant);
  void check_prints(const std::vector<bridge::TaskHistory>& tasks, const Plant& plant);

  std::function<void(const std::string&)> wrong_;
  std::map<std::string, Json> accepted_;
  std::map<std::string, task::Outcome> ended_;
  std::set<std::string> told_to_end_;
  std::optional<Time> reset_at_, armed_at_, stopped_at_;
  link::SafetyState before_ = link::SafetyState::kDisarmed;
  Time emergency_at_;
  bool needs_person_ = false;
  Kept kept_ = Kept::kAll;
};

}  // namespace pons::tests
