// Everything that happens at the bridge's pace of 100 Hz, the same in lockstep and in real time: beliefs in, the
// brain's tasks admitted, skills ticked, outcomes out, visitors answered.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pons/brain/dispatcher.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/observer.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

inline constexpr Duration kBridgePeriod = std::chrono::milliseconds(10);

// The skills as the runner sees them; it knows none by name.
struct SkillPort {
  // Before any skill is ticked: the beliefs, and after them what is only an obstacle.
  std::function<void(Time, std::vector<ObjectBelief>)> refresh;
  std::function<const link::State&()> state;                   // as of the last refresh
  std::function<std::vector<std::uint32_t>()> take_forgotten;  // tracks that were taken off the belt
  std::function<void(Time)> arm;                               // one step out of a stop, towards operational
  std::function<double()> outside_rad;                         // how far the arm stands outside its position limits
  std::function<Expected<void>(Time)> recover;                 // one step from there to inside them
  std::function<void(Time)> rest;                              // once a period while no skill runs
  std::function<void()> halt;                                  // a protective stop
  std::function<bridge::Json()> carries;                       // what is on the cups; null when nothing is
  // After a bridge that is no more: believes what that one wrote of carries(); what becomes of a task that it had
  // begun; and, once the arm is armed, lets go of what nobody knows.
  std::function<void(const bridge::Json&)> restore;
  bridge::Resume resume;
  std::function<void()> settle;
};

// Whether an arm that is found outside its position limits may be brought in; else the run ends and says so.
enum class Recovery : std::uint8_t { kRefused, kAllowed };

class BridgeSide {
 public:
  // All must outlive it. `zones` are the world's. `visitors` is called once a period, before the bridge's tick:
  // requests from outside.
  BridgeSide(bridge::Bridge& bridge, brain::Dispatcher& dispatcher, SkillPort skills,
             const std::vector<world::Zone>& zones, Recovery recovery, std::function<void(Time)> visitors);

  // Instead of a bridge that is no more, on its journal and before the first tick: stops an arm that still moves as
  // that one told it to, and takes up what is open; nothing starts before the arm was armed anew. Error: the journal.
  [[nodiscard]] Expected<void> take_over(const bridge::Journal& journal, Time now);
  // One period. Error: the journal failed, or the arm stands where it may not be armed; the run cannot go on.
  [[nodiscard]] Expected<void> tick(Time now, Observer& observer);
  // Lets running skills leave the world safe and takes no more from the brain; tick on until idle().
  void stop(Time now, const std::string& reason);
  [[nodiscard]] bool idle() const;
  // Writes what became of orders that were never identified. Once, at the end of a run.
  void close(Time now);

  [[nodiscard]] Time last_outcome() const { return last_outcome_; }  // of a task that the brain asked for
  [[nodiscard]] std::int64_t retries() const { return bridge_.retries(); }
  [[nodiscard]] std::int64_t stops() const { return stops_; }

 private:
  void take_in(const Snapshot& snapshot, Time now);
  [[nodiscard]] std::vector<ObjectBelief> predicted(const std::vector<ObjectBelief>& seen, Time now,
                                                    double belt_travel_m) const;
  void ask_brain(const std::vector<ObjectBelief>& objects, Time now);
  void note_carried(Time now);
  void look_around(Time now);
  [[nodiscard]] Expected<void> look_after_arm(Time now);
  [[nodiscard]] Expected<void> bring_in(Time now);
  [[nodiscard]] bool may_resume(const link::State& state, Time now) const;
  [[nodiscard]] bool zones_are_empty(Time now) const;

  bridge::Bridge& bridge_;
  brain::Dispatcher& dispatcher_;
  SkillPort skills_;
  const std::vector<world::Zone>& zones_;
  Recovery recovery_;
  std::function<void(Time)> visitors_;
  Snapshot seen_;
  std::vector<std::uint32_t> gone_;       // taken off the belt, while snapshots may still show them
  std::vector<std::uint32_t> forgotten_;  // to tell perception with the next frame
  bridge::Json carried_;                  // as last noted
  std::optional<Time> stopped_since_;
  std::array<std::optional<Time>, kMaxZones> occupied_at_;  // last
  std::uint32_t zones_occupied_ = 0;
  Time last_outcome_;
  std::int64_t stops_ = 0, unlabelled_ = 0;
  bool stopping_ = false, was_operational_ = false, recovering_ = false;
  bool took_over_ = false;  // and the arm has not been armed since
  bool yielding_ = false;   // it still moves as it was told before
};

}  // namespace pons::runner
