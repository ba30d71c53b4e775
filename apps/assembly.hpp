// Puts one cell together: world, simulated body, cerebellum, link, perception, bridge, skills, brain. Nothing runs yet.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "apps/desk.hpp"
#include "pons/brain/dispatcher.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/error.hpp"
#include "pons/link/link.hpp"
#include "pons/perception/perception.hpp"
#include "pons/runner/bridge_side.hpp"
#include "pons/runner/camera_crew.hpp"
#include "pons/runner/helper.hpp"
#include "pons/runner/lockstep.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/skills/cell.hpp"
#include "pons/skills/rest.hpp"
#include "pons/skills/skills.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct AssemblyOptions {
  std::filesystem::path journal;                // ":memory:" for none on disk
  std::optional<std::filesystem::path> socket;  // where visitors may ask
  std::uint64_t seed = 1;
  runner::Pace pace = runner::Pace::kLockstep;
  std::vector<sim::Visit> visits;    // who comes into which zone
  std::optional<AxisVector> arm_at;  // where the arm is found; at home without it
  runner::Recovery recovery = runner::Recovery::kRefused;
};

// Members stand in the order in which they need each other.
class Assembly {
 public:
  // Errors: whatever a part says about its files. Nothing is left half-written.
  [[nodiscard]] static Expected<std::unique_ptr<Assembly>> build(world::World world, const world::Manifest& manifest,
                                                                 const AssemblyOptions& options);

  [[nodiscard]] runner::Parts parts();

  world::World world;
  std::unique_ptr<sim::Simulation> simulation;
  std::unique_ptr<bridge::Journal> journal;
  link::Link link;
  link::BridgeEnd bridge_end{link};
  link::CerebellumEnd cerebellum_end{link};
  std::unique_ptr<cerebellum::Cerebellum> cerebellum;
  runner::Helper helper;  // perception's
  std::unique_ptr<perception::Perception> perception;
  std::unique_ptr<skills::Cell> cell;
  std::unique_ptr<skills::Rest> rest;
  task::SkillRegistry registry;
  std::unique_ptr<bridge::Bridge> bridge;
  std::unique_ptr<brain::Dispatcher> dispatcher;
  std::unique_ptr<Desk> desk;
  std::unique_ptr<runner::CameraCrew> crew;
  std::unique_ptr<runner::BridgeSide> bridge_side;

 private:
  explicit Assembly(world::World w) : world(std::move(w)) {}
  [[nodiscard]] runner::SkillPort skill_port();
};

}  // namespace pons::apps
