// A brain that lies beside its honest work: now and then it asks for something wrong, too. A fault
// (docs/decisions/0029-faults-as-data.md).
#pragma once

#include <cstdint>
#include <deque>
#include <set>
#include <string>
#include <vector>

#include "pons/brain/brain.hpp"
#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/world.hpp"

namespace pons::brain {

enum class Lie : std::uint8_t {
  kUnknownSkill,
  kWrongType,      // of an argument
  kUnknownObject,  // a pick of what nobody has seen
  kUnknownPlace,
  kElsewhere,      // into another chute than ordered
  kContradiction,  // one parcel into two chutes, by two tasks of one moment
  kTakenId,        // something else under the id of a task that it has asked for
  kForestalledId,  // something else under the id that it will ask for next
  kPriority,       // of a thousand millions
  kDeadline,       // long past
  kTooDeep,        // arrays in arrays
  kTooLong,        // an argument of 100,000 characters
  kSortedAlready,  // a parcel that is sorted, once more and urgently
  kPickOnly,       // of one that lies there, urgently; nothing is said of what to do with it
  kPlaceOnly,      // of one that it did not have picked by this task, urgently
  kPutAway,        // into the exception chute, urgently
  kTwice,          // what it has asked for, urgently and under another id
  kMoves,          // the arm to and fro, urgently
  kNoTask,         // what is no task at all
  kBadId,          // a number where an id belongs
  kBadText,        // bytes that are no text
};
inline constexpr std::size_t kLies = 21;

// When lies come and which, for a whole run: it outlives the brains. All kinds in turn, in an order drawn anew each
// time.
class Lies {
 public:
  Lies(const world::FaultRate& rate, const Random& random);
  // Whether one is told in this period, and which. Times must not go back.
  [[nodiscard]] std::optional<Lie> due(Time now);
  [[nodiscard]] std::int64_t count() const { return count_; }
  // For its id; differs from every other's of the run.
  [[nodiscard]] std::string new_id() { return std::string("lie-").append(std::to_string(++ids_)); }

 private:
  void wait(Time after);

  double an_hour_;
  Random random_;
  Time next_;
  std::vector<Lie> left_;  // of this turn
  std::int64_t count_ = 0, ids_ = 0;
};

// What becomes of its lies the honest brain does not hear. One thread.
class Liar final : public Brain {
 public:
  // All must outlive it.
  Liar(Brain& honest, Lies& lies, const world::World& world) : honest_(honest), lies_(lies), world_(world) {}

  [[nodiscard]] Decisions observe(const std::vector<ObjectBelief>& beliefs, Time now,
                                  const std::set<std::string>& set_aside) override;
  void taken_until(double x_m) override { honest_.taken_until(x_m); }
  bool heard(std::string_view id, task::Outcome outcome) override;
  void taken(const Json& task) override;
  bool refused(const Json& task, const Error& why) override;
  void recall(const task::Task& task, std::optional<task::Outcome> outcome) override;
  void recall_ride(std::string_view code) override { honest_.recall_ride(code); }
  [[nodiscard]] std::vector<std::string> unseen() const override { return honest_.unseen(); }
  [[nodiscard]] bool waits() const override { return honest_.waits(); }

 private:
  [[nodiscard]] std::vector<Json> tell(Lie lie, const std::vector<ObjectBelief>& beliefs);
  [[nodiscard]] bool is_lie(const Json& task);
  // Of a task that it has asked for honestly, and that has no outcome yet; or any, where there is none.
  struct Subject {
    std::string id, code, place;
  };
  [[nodiscard]] Subject asked() const;
  [[nodiscard]] std::string another_chute(const std::string& than) const;
  [[nodiscard]] std::string exception() const;

  Brain& honest_;
  Lies& lies_;
  const world::World& world_;
  std::deque<Subject> open_, ended_;          // honest ones, the last
  std::vector<Json> told_;                    // lies that were not answered yet
  std::set<std::string, std::less<>> taken_;  // ids of those that were taken
};

}  // namespace pons::brain
