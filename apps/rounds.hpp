// Puts a base on its rounds together: world, simulated base, cerebellum, link, localiser, bridge, skills, brain.
// Nothing runs yet. What stands below the link and what above it are the same parts as a cell's; only who fills them
// differs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/by_hand.hpp"
#include "apps/desk.hpp"
#include "apps/ros_node.hpp"
#include "apps/views/outlets.hpp"
#include "apps/views/run_views.hpp"
#include "pons/brain/errands.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/link/link.hpp"
#include "pons/perception/localiser.hpp"
#include "pons/runner/darkroom.hpp"
#include "pons/runner/run.hpp"
#include "pons/runner/speaker.hpp"
#include "pons/sim/base_simulation.hpp"
#include "pons/skills/base/base_skills.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct RoundsSetup {
  std::uint64_t seed = 1;
  std::string journal;                          // a place as in journal/place.hpp; ":memory:" for none on disk
  std::optional<std::filesystem::path> socket;  // where visitors may ask
  std::optional<gate::ros::NodeSettings> ros;   // likewise, and see
  std::vector<Sink*> sinks = {};                // where else it shows itself; they outlive it
  std::vector<gate::Visitors*> visitors = {};   // who else may ask; likewise
  std::filesystem::path speech;                 // folder for what is said
  runner::Pace pace = runner::Pace::kLockstep;
  std::uint64_t keep_free = runner::kKeptFree;  // bytes on the journal's disk
  enum class Ends : std::uint8_t {
    kWithItsTasks,     // when nothing is left that was asked for
    kWhenInterrupted,  // it waits for what comes
  };
  Ends ends = Ends::kWithItsTasks;
};

// Members stand in the order in which they need each other.
class Rounds {
 public:
  // `world` must have a base. Errors: whatever a part says about its files; a journal that holds an earlier run.
  [[nodiscard]] static Expected<std::unique_ptr<Rounds>> build(world::World world, std::vector<brain::Errand> errands,
                                                               const RoundsSetup& setup);
  [[nodiscard]] runner::Parts parts();
  // What there is to be shown now, once a period; and after the last, for what that has brought.
  void show(Time now);
  // The base is steered so for half a second, by a task of the id that is given back; whoever steers on asks again.
  // Errors: another task has the base, or waits for it; the robot is not armed; those of Bridge::submit().
  [[nodiscard]] Expected<std::string> steer(const model::Twist2& twist, Time now);
  // A line for people, to whoever looks on; `level` is one of LogView::Log's.
  void say(std::uint8_t level, Time at, std::string_view line);

  world::World world;
  link::Link link;
  runner::Darkroom darkroom{world};
  link::CerebellumEnd body_end{link};
  link::BridgeEnd bridge_end{link};
  std::unique_ptr<sim::BaseSimulation> simulation;
  std::unique_ptr<cerebellum::Cerebellum> cerebellum;
  std::unique_ptr<runner::Photographer> photographer;
  std::unique_ptr<bridge::Journal> journal;
  perception::Localiser localiser{world};
  std::unique_ptr<skills::Chassis> chassis;
  std::unique_ptr<runner::Speaker> speaker;
  gate::ros::OutsideSkills outside;
  task::SkillRegistry registry;
  std::unique_ptr<bridge::Bridge> bridge;
  brain::Errands errands;
  std::unique_ptr<runner::Observer> observer;
  std::unique_ptr<runner::BridgeSide> bridge_side;
  std::unique_ptr<RosNode> ros;
  Outlets outlets;
  std::vector<std::unique_ptr<View>> views;  // of what it shows
  std::unique_ptr<Desk> desk;

 private:
  Rounds(world::World w, std::vector<brain::Errand> e) : world(std::move(w)), errands(std::move(e)) {}
  [[nodiscard]] Expected<void> build_body(const RoundsSetup& setup);
  [[nodiscard]] Expected<void> build_bridge(const RoundsSetup& setup);
  [[nodiscard]] Expected<void> review(const bridge::tree::Library& trees) const;
  [[nodiscard]] std::vector<runner::SkillPort> skill_ports();
  // Where it is, for who asks the desk.
  [[nodiscard]] bridge::Json describe(Time now) const;
  [[nodiscard]] Expected<void> open_ros(const RoundsSetup& setup);
  [[nodiscard]] Expected<void> open_views(const RoundsSetup& setup);
  void open_desk(std::unique_ptr<gate::Visitors> visitors);

  RoundsSetup::Ends ends_ = RoundsSetup::Ends::kWithItsTasks;
  RunViews* run_views_ = nullptr;  // one of the views
  std::optional<ByHand> steered_;
};

// How the loop watches the wheels of a base.
[[nodiscard]] cerebellum::Settings wheel_settings();

}  // namespace pons::apps
