#include "apps/cell_skills.hpp"

#include <utility>

#include "apps/outside.hpp"
#include "apps/paths.hpp"
#include "apps/policies.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/runner/speaker.hpp"

namespace pons::apps {

Expected<std::unique_ptr<CellSkills>> CellSkills::make(const std::string& name) {
  const auto folder = worlds_folder();
  const std::vector<std::string> names = world::list(folder);
  if (names.empty()) return fail("no worlds", folder.string(), "set PONS_WORLDS to a folder of worlds");
  auto world = world::load(folder, name.empty() ? names.front() : name);
  if (!world) return std::unexpected(world.error());
  auto self = std::make_unique<CellSkills>();
  self->world = *std::move(world);
  self->link = std::make_unique<link::Link>();
  self->end = std::make_unique<link::BridgeEnd>(*self->link);
  const auto outside = gate::ros::OutsideSkills::compile(self->world.outside_skills, interface_folders(self->world));
  if (!outside) return std::unexpected(outside.error());
  if (self->world.base) {
    self->chassis = std::make_unique<skills::Chassis>(*self->end, self->world);
    self->speech = std::make_unique<runner::Speaker>(".", runner::Pace::kLockstep);
    skills::add_base_skills(self->registry, *self->chassis, *self->speech);
    if (auto added = outside->add_to(self->registry); !added) return std::unexpected(added.error());
    return self;
  }
  const world::World& station = self->world.arms().front();
  auto model = model::RobotModel::load(station.robot);
  if (!model) return std::unexpected(model.error());
  self->cell = std::make_unique<skills::Cell>(*self->end, station, std::move(*model));
  skills::add_skills(self->registry, *self->cell, policy_names());
  if (auto added = outside->add_to(self->registry); !added) return std::unexpected(added.error());
  return self;
}

}  // namespace pons::apps
