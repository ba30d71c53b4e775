// One bridge process: journal, bridge, arbiter, review, trees, desk, dispatcher, arming, arm, link and take-up are the
// product's, put together as `pons bridge` does it; beliefs come from the plant instead of perception, and the skills
// are this test's own. It begins, ticks, and is gone: in order, or wherever its steps say.
#pragma once

#include <memory>

#include "apps/desk.hpp"
#include "pons/brain/dispatcher.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/link/link.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/perception/sight.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/darkroom.hpp"
#include "pons/runner/observer.hpp"
#include "pons/skills/cell.hpp"
#include "pons/skills/take_up.hpp"
#include "pons/world/world.hpp"
#include "tests/crash/disk.hpp"
#include "tests/system/hand.hpp"
#include "tests/system/network.hpp"
#include "tests/system/plant.hpp"
#include "tests/system/steps.hpp"

namespace pons::tests {

inline constexpr const char* kJournal = "disk.db";

// What outlives a bridge process. All of it outlives every process.
struct Outside {
  const world::World& world;
  const model::RobotModel& model;
  Plant& plant;
  link::Link& link;
  Disk& disk;
  Steps& steps;
  Network& network;
  const brain::Orders& orders;  // what the bridge's own brain asks for
  const Time& now;              // the world's clock
};

class Process {
 public:
  // Takes over from whoever was before. Error: what the product says; of a process that died on the way, anything.
  [[nodiscard]] static Expected<std::unique_ptr<Process>> start(const Outside& outside);
  ~Process();

  // One period. Error: likewise.
  [[nodiscard]] Expected<void> tick();
  // As Ctrl-C does: tick on until idle().
  void stop() { side_->stop(outside_.now, "asked to end"); }
  [[nodiscard]] bool idle() const { return side_->idle(); }
  [[nodiscard]] const bridge::Bridge& bridge() const { return *bridge_; }
  [[nodiscard]] const bridge::Journal& journal() const { return *journal_; }
  // The code by which it knows what hangs on the cups; empty: nothing, as it believes.
  [[nodiscard]] std::string carries() const { return cell_.held ? cell_.held->code : std::string(); }
  // How much room is in the link.
  [[nodiscard]] std::size_t room() { return end_.room(); }

 private:
  explicit Process(const Outside& outside);
  [[nodiscard]] runner::SkillPort skill_port();
  [[nodiscard]] bridge::Resumption resume(const task::Task& task, std::size_t done);

  Outside outside_;
  link::BridgeEnd end_;
  std::unique_ptr<perception::Sight> sight_;
  runner::Darkroom darkroom_;
  std::unique_ptr<bridge::Journal> journal_;
  skills::Cell cell_;
  LayDown lay_down_;
  skills::TakeUp take_up_;
  task::SkillRegistry registry_;
  std::unique_ptr<bridge::Bridge> bridge_;
  std::unique_ptr<brain::Brain> brain_;
  std::unique_ptr<runner::Observer> observer_;
  std::unique_ptr<runner::BridgeSide> side_;
  std::unique_ptr<apps::Desk> desk_;
};

}  // namespace pons::tests
