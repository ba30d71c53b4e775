// Everything that happens at the bridge's pace of 100 Hz, the same in lockstep and in real time: beliefs in, the
// brain's tasks admitted, skills ticked, outcomes out, visitors answered.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/brain/brain.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/runner/arming.hpp"
#include "pons/runner/health.hpp"
#include "pons/runner/observer.hpp"
#include "pons/runner/robot_vitals.hpp"
#include "pons/runner/skill_port.hpp"
#include "pons/runner/vitals.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/world.hpp"

namespace pons::runner {

inline constexpr Duration kBridgePeriod = std::chrono::milliseconds(10);

class BridgeSide {
 public:
  // All must outlive it. `robots` are those of the bridge, in its order. `visitors` is called once a period, before the
  // bridge's tick: requests from outside.
  BridgeSide(bridge::Bridge& bridge, brain::Brain& brain, std::vector<SkillPort> robots, const world::World& world,
             Recovery recovery, std::function<void(Time)> visitors);

  // Instead of a bridge that is no more, on its journal and before the first tick: stops an arm that still moves as
  // that one told it to, and takes up what is open; nothing starts before the arm was armed anew. Error: the journal.
  [[nodiscard]] Expected<void> take_over(const bridge::Journal& journal, Time now);
  // What the report of a run tells of all its bridges together. Where one is killed within a run, the next begins with
  // what it had come to, before take_over(); nothing is decided by it.
  struct Account {
    std::int64_t retries = 0;
    std::vector<Arming::Interventions> interventions;         // of each robot
    std::map<std::string, std::int64_t, std::less<>> alerts;  // of each part
  };
  [[nodiscard]] Account account() const;
  void begin_with(const Account& before, Time now);
  // One period. Error: the journal failed, or the arm stands where it may not be armed; the run cannot go on.
  [[nodiscard]] Expected<void> tick(Time now, Observer& observer);
  // Lets running skills leave the world safe and takes no more from the brain; tick on until idle().
  void stop(Time now, const std::string& reason);
  [[nodiscard]] bool idle() const;
  // Nothing new is decided, taken or begun; the belt waits; tasks that run stand at their next safe point, and go on
  // with go_on(). Either may be called again.
  void rest(Time now);
  void go_on(Time now);
  // Whether all that stands by now.
  [[nodiscard]] bool rests() const;
  // Writes what became of orders that were never identified. Once, at the end of a run.
  void close(Time now);

  // From now on the brain is silent in these spells, which outlive this.
  void stall_brain(world::Spells& stalls) { stalls_ = &stalls; }
  // See Vitals.
  void keep_free(std::uint64_t bytes) { vitals_.keep_free(bytes); }

  // What perception said last; with no stamp before it has said anything.
  [[nodiscard]] const Snapshot& seen() const { return seen_; }
  [[nodiscard]] Time last_outcome() const { return last_outcome_; }  // of a task that the brain asked for
  [[nodiscard]] std::int64_t retries() const { return retries_before_ + bridge_.retries(); }
  [[nodiscard]] std::int64_t stops() const;
  [[nodiscard]] std::int64_t interventions() const;
  // For a person's words; of a robot there is.
  [[nodiscard]] Arming& arming(std::size_t robot = 0) { return robots_[robot]->arming; }
  [[nodiscard]] std::vector<Arming*> armings();
  [[nodiscard]] bool waits_for_person() const;        // every robot
  [[nodiscard]] Health& health() { return health_; }  // of every part

 private:
  void recall(const bridge::Event& note);
  void take_in(const Snapshot& snapshot, Time now);
  void look_after_parts(Time now);
  void hold_back();
  [[nodiscard]] std::vector<ObjectBelief> predicted(const std::vector<ObjectBelief>& seen, Time now,
                                                    double belt_travel_m) const;
  // Whether the belt shall wait for what was asked for.
  bool ask_brain(const std::vector<ObjectBelief>& objects, Time now);
  [[nodiscard]] brain::Decisions hear_brain(const std::vector<ObjectBelief>& objects, Time now);
  void submit_all(const brain::Decisions& decisions, const std::vector<ObjectBelief>& objects, Time now);
  // Likewise, while nothing is decided.
  bool fall_back(const std::vector<ObjectBelief>& objects, Time now);
  void let_ride(const ObjectBelief& object, Time now);
  [[nodiscard]] bool rode(const ObjectBelief& object) const;
  void tell_brain_what_rode();
  [[nodiscard]] std::optional<double> taken_until_m() const;
  void note_seen(const std::string& code, const std::vector<ObjectBelief>& objects, Time now);
  // What is one a robot.
  struct Robot {
    Robot(bridge::Bridge& bridge, SkillPort port, const std::vector<world::Zone>& zones, Recovery recovery,
          RobotVitals of_it)
        : skills(std::move(port)), arming(bridge, skills, zones, recovery), vitals(std::move(of_it)) {}
    SkillPort skills;
    Arming arming;
    RobotVitals vitals;
    bridge::Json carried = {};  // as last noted
    bool armed_before = false;  // by an earlier bridge
    [[nodiscard]] bool operational() const { return skills.state().safety == link::SafetyState::kOperational; }
  };

  [[nodiscard]] const SkillPort& first() const { return robots_.front()->skills; }
  [[nodiscard]] bool stands_in_the_way(const Robot& robot) const;
  void tell_belt(bool waits, Time now);
  [[nodiscard]] Expected<void> note_carried(Robot& robot, Time now);

  const world::World& world_;
  bridge::Bridge& bridge_;
  brain::Brain& brain_;
  Health health_;
  Vitals vitals_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::function<void(Time)> visitors_;
  Snapshot seen_;
  Duration seen_behind_{0};               // of when it was due
  std::vector<std::uint32_t> gone_;       // taken off the belt, while snapshots may still show them
  std::vector<std::uint32_t> forgotten_;  // to tell perception with the next frame
  Time last_outcome_, brain_heard_;
  Time decided_;                                           // when the brain was last asked
  bool falls_back_ = false;                                // to the world's rules
  std::map<std::string, std::string, std::less<>> asked_;  // code by task: what the brain asked for and has no outcome
  std::vector<std::string> rode_;                          // codes, by those rules: to tell the brain
  std::vector<std::uint32_t> rode_tracks_;                 // likewise; nothing is left for it to decide
  bool brain_holds_belt_ = false;                          // as it last said
  world::Spells* stalls_ = nullptr;
  std::int64_t unlabelled_ = 0, retries_before_ = 0;
  bool stopping_ = false;
  bool resting_ = false;
};

}  // namespace pons::runner
