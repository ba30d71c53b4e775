// Puts one cell together: world, simulated body, cerebellum, link, perception, bridge, skills, brain. Nothing runs yet.
// What lies below the link and what lies above it are put together apart, for they may live in two processes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/brain_faults.hpp"
#include "apps/by_hand.hpp"
#include "apps/desk.hpp"
#include "apps/ros_node.hpp"
#include "apps/views/cameras_view.hpp"
#include "apps/views/outlets.hpp"
#include "apps/views/run_views.hpp"
#include "pons/brain/dispatcher.hpp"
#include "pons/brain/far_brain.hpp"
#include "pons/brain/liar.hpp"
#include "pons/brain/policy_runner.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/link/frames.hpp"
#include "pons/link/link.hpp"
#include "pons/perception/perception.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/crashes.hpp"
#include "pons/runner/darkroom.hpp"
#include "pons/runner/helper.hpp"
#include "pons/runner/lockstep.hpp"
#include "pons/runner/observer.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/skills/cell.hpp"
#include "pons/skills/rest.hpp"
#include "pons/skills/skills.hpp"
#include "pons/skills/take_up.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Where both halves meet, and at whose pace. Everything outlives them.
struct Meeting {
  std::vector<link::Link*> links;  // one for each of world.arms()
  link::Frames& frames;
  const link::FramePages& pages;
  std::byte* pixels;
  runner::Pace pace;
};

// What a simulated body begins with.
struct BodySetup {
  std::uint64_t seed = 1;
  std::vector<sim::Visit> visits;    // who comes into which zone
  std::optional<AxisVector> arm_at;  // where the arm is found; at home without it
  world::FaultPlan faults;           // what goes wrong
  bool stays = false;                // it is never finished
};

// Members stand in the order in which they need each other.
class BodyHalf {
 public:
  // `world` must outlive it. Errors: whatever a part says about its files; more cameras than the link has places;
  // limits that contradict each other or that the drives cannot keep.
  [[nodiscard]] static Expected<std::unique_ptr<BodyHalf>> build(const world::World& world,
                                                                 const world::Manifest& manifest,
                                                                 const BodySetup& setup, const Meeting& meeting);
  [[nodiscard]] runner::BodyParts parts();

  world::FaultPlan faults;
  bool stays = false;
  cerebellum::Settings settings;
  runner::Helper helper;  // the cameras'
  std::unique_ptr<sim::Simulation> simulation;
  // What is one an arm, below the link.
  struct Arm {
    Arm(std::string the_name, link::Link& link, model::RobotModel the_model, const cerebellum::Settings& settings)
        : name(std::move(the_name)), end(link), model(std::move(the_model)) {
      cerebellum.emplace(model.copy(), settings, Time{});
    }
    std::string name;  // empty where there is no other
    link::CerebellumEnd end;
    model::RobotModel model;
    std::optional<cerebellum::Cerebellum> cerebellum;  // always there; another one, at the same address, after a crash
    cerebellum::Statistics before;                     // of those before it
    [[nodiscard]] cerebellum::Statistics statistics() const;  // of all together
  };
  // Nothing of the loops that there were is left but their links. The first step of the new ones is the one at `now`.
  void replace_loops(Time now);
  std::vector<std::unique_ptr<Arm>> arms;  // in the order of world.arms()
  std::unique_ptr<runner::Photographer> photographer;
};

struct BridgeOptions {
  std::string journal;                          // a place as in journal/place.hpp; ":memory:" for none on disk
  std::optional<std::filesystem::path> socket;  // where visitors may ask
  std::optional<gate::ros::NodeSettings> ros;   // likewise, and see
  std::vector<Sink*> sinks = {};                // where else it shows itself; they outlive it
  std::vector<gate::Visitors*> visitors = {};   // who else may ask; likewise
  // A body that outlives its bridges: the journal of an earlier bridge of the same body is taken up; one in a database
  // also of another body, which is gone; each other that holds something is refused. Without: each such.
  std::optional<std::uint64_t> body;
  std::string link = {};  // where that body and its bridges meet
  runner::Recovery recovery = runner::Recovery::kRefused;
  std::uint64_t keep_free = runner::kKeptFree;  // bytes on the journal's disk
  enum class Comes : std::uint8_t { kFirst, kFirstOrLater };
  Comes comes = Comes::kFirstOrLater;  // to its body; the first takes up no journal
  BrainFaults* faults = nullptr;       // they outlive bridge and brain
};

class BridgeHalf {
 public:
  // `world` must outlive it. Errors: whatever a part says about its files. Nothing is left half-written.
  [[nodiscard]] static Expected<std::unique_ptr<BridgeHalf>> build(const world::World& world,
                                                                   const world::Manifest& manifest,
                                                                   const BridgeOptions& options,
                                                                   const Meeting& meeting);

  // What is one an arm, above the link.
  struct Arm {
    Arm(link::Link& link, const world::World& station, model::RobotModel model, Duration splice_lead)
        : end(link), cell(end, station, std::move(model), splice_lead) {}
    link::BridgeEnd end;
    skills::Cell cell;
    skills::Rest rest{cell};
    skills::TakeUp take_up{cell};
    task::SkillRegistry registry;
  };
  // The first one's, where there is no other.
  [[nodiscard]] skills::Cell& cell() { return arms.front()->cell; }
  // Whether any arm has something on its cups.
  [[nodiscard]] bool holds_something() const;
  // What there is to be shown now, once a period; and after the last, for what that has brought.
  void show(Time now);
  // A line for people, to whoever looks on; `level` is one of LogView::Log's.
  void say(std::uint8_t level, Time at, std::string_view line);
  // Goes as a killed process does: what its journal has not made durable is lost.
  static void kill(std::unique_ptr<BridgeHalf> half);

  std::unique_ptr<bridge::Journal> journal;
  runner::Helper helper;  // perception's
  std::unique_ptr<perception::Perception> perception;
  gate::ros::OutsideSkills outside;
  std::unique_ptr<CamerasView> cameras;    // only where somebody may look on
  std::vector<std::unique_ptr<Arm>> arms;  // in the order of world.arms()
  std::unique_ptr<bridge::Bridge> bridge;
  std::unique_ptr<brain::Dispatcher> dispatcher;
  std::unique_ptr<brain::FarBrain> far_brain;  // only where the network between them fails
  std::unique_ptr<brain::Liar> liar;           // only where it lies
  std::unique_ptr<brain::Inference> inference;
  std::unique_ptr<brain::PolicyRunner> policies;
  std::unique_ptr<runner::Observer> observer;
  std::unique_ptr<runner::BridgeSide> bridge_side;
  std::unique_ptr<RosNode> ros;
  Outlets outlets;
  std::vector<std::unique_ptr<View>> views;  // of what it shows
  std::unique_ptr<Desk> desk;

 private:
  [[nodiscard]] Expected<void> add_arms(const world::World& world, const Meeting& meeting);
  [[nodiscard]] Expected<void> open_journal(const BridgeOptions& options);
  [[nodiscard]] Expected<void> add_observer(const world::World& world, const Meeting& meeting);
  [[nodiscard]] Expected<void> open_sinks(const world::World& world, const BridgeOptions& options);
  [[nodiscard]] Expected<void> open_views(const world::World& world, const BridgeOptions& options);
  [[nodiscard]] Expected<void> open_inner_views(const world::World& world);
  [[nodiscard]] HealthView::Sources health_sources(const world::World& world, const gate::ros::NodeName& name);
  [[nodiscard]] std::vector<runner::SkillPort> skill_ports();
  // As the bridge hears it.
  [[nodiscard]] brain::Brain& add_brain(const world::World& world, const world::Manifest& manifest,
                                        const BridgeOptions& options);

  // The arm goes to that set-point, by a task of the id that is given back. Errors: of several arms; the arm is not
  // armed; those of ByHand::take() and Servo::take().
  [[nodiscard]] Expected<std::string> servo(const AxisVector& position, Time now);

  RunViews* run_views_ = nullptr;  // one of the views
  std::optional<ByHand> servoed_;  // of one arm
};

struct AssemblyOptions {
  std::string journal;                          // as in BridgeOptions
  std::optional<std::filesystem::path> socket;  // likewise
  std::optional<gate::ros::NodeSettings> ros;   // likewise
  std::vector<Sink*> sinks = {};                // likewise
  std::vector<gate::Visitors*> visitors = {};   // likewise
  BodySetup body;
  runner::Pace pace = runner::Pace::kLockstep;
  runner::Recovery recovery = runner::Recovery::kRefused;
  std::uint64_t keep_free = runner::kKeptFree;
};

// Both halves in this process.
class Assembly {
 public:
  // Errors: those of the halves; a bridge that is to be killed with a journal in memory.
  [[nodiscard]] static Expected<std::unique_ptr<Assembly>> build(world::World world, const world::Manifest& manifest,
                                                                 const AssemblyOptions& options);

  [[nodiscard]] runner::Parts parts();
  // Of those faults that strike above the link, how often each was injected; the body's simulation counts the others.
  void count_injected(world::FaultCounts& counts) const;

  world::World world;
  std::vector<std::unique_ptr<link::Link>> links;
  runner::Darkroom darkroom{world};
  std::unique_ptr<BodyHalf> body;
  std::unique_ptr<BridgeHalf> above;  // another one after each crash

 private:
  Assembly(world::World w, world::Manifest manifest, AssemblyOptions options)
      : world(std::move(w)),
        manifest_(std::move(manifest)),
        options_(std::move(options)),
        faults_(options_.body.faults, options_.body.seed) {}
  [[nodiscard]] Meeting meeting();
  [[nodiscard]] Expected<void> build_above(BridgeOptions::Comes comes);
  void kill_above();
  [[nodiscard]] Expected<runner::Above> replace_above(Time now);

  const world::Manifest manifest_;
  const AssemblyOptions options_;
  BrainFaults faults_;
  std::optional<runner::Crashes> crashes_;
  std::optional<runner::LoopCrashes> loop_crashes_;
  runner::BridgeSide::Account account_;  // of the bridges that were killed
};

// What becomes of a task that a bridge which is no more had begun, of whose steps so many were done.
[[nodiscard]] bridge::Resumption resumption(const skills::TakeUp& take_up, const task::Task& task, std::size_t done);

// Where a body that lives meets its bridges, one of which wrote this journal last; empty: there is no such body.
[[nodiscard]] Expected<std::string> link_that_lives(const bridge::Journal& journal);

}  // namespace pons::apps
