// Puts a base on its rounds together: world, simulated base, cerebellum, link, localiser, bridge, skills, brain.
// Nothing runs yet. What stands below the link and what above it are the same parts as a cell's; only who fills them
// differs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "apps/desk.hpp"
#include "pons/brain/errands.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
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
  std::filesystem::path speech;                 // folder for what is said
  runner::Pace pace = runner::Pace::kLockstep;
  std::uint64_t keep_free = runner::kKeptFree;  // bytes on the journal's disk
};

// Members stand in the order in which they need each other.
class Rounds {
 public:
  // `world` must have a base. Errors: whatever a part says about its files; a journal that holds an earlier run.
  [[nodiscard]] static Expected<std::unique_ptr<Rounds>> build(world::World world, std::vector<brain::Errand> errands,
                                                               const RoundsSetup& setup);
  [[nodiscard]] runner::Parts parts();

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
  task::SkillRegistry registry;
  std::unique_ptr<bridge::Bridge> bridge;
  brain::Errands errands;
  std::unique_ptr<runner::Observer> observer;
  std::unique_ptr<runner::BridgeSide> bridge_side;
  std::unique_ptr<Desk> desk;

 private:
  Rounds(world::World w, std::vector<brain::Errand> e) : world(std::move(w)), errands(std::move(e)) {}
  [[nodiscard]] Expected<void> build_body(const RoundsSetup& setup);
  [[nodiscard]] Expected<void> build_bridge(const RoundsSetup& setup);
  [[nodiscard]] Expected<void> review(const bridge::tree::Library& trees) const;
  [[nodiscard]] std::vector<runner::SkillPort> skill_ports();
};

// How the loop watches the wheels of a base.
[[nodiscard]] cerebellum::Settings wheel_settings();

}  // namespace pons::apps
