#include "apps/assembly.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

namespace pons::apps {
namespace {

// What a warehouse system would know in the morning: which code goes where, and how urgently. Not what a parcel weighs.
brain::Orders orders_of(const world::Manifest& manifest) {
  brain::Orders orders;
  for (const world::ManifestRow& row : manifest) orders[row.parcel_id] = {row.destination, row.priority};
  return orders;
}

// What the skills hold must be there to be held; nobody could submit a task otherwise.
Expected<void> check_resources(const task::SkillRegistry& skills, const world::World& world) {
  for (const auto& [name, type] : skills.all()) {
    for (const std::string& needed : type.resources) {
      if (std::ranges::find(world.resources, needed, &world::Resource::name) != world.resources.end()) continue;
      return fail(fmt::format("resources: there is no '{}', which the skill '{}' holds", needed, name),
                  (world.folder / "world.yaml").string(), "add it to resources");
    }
  }
  return {};
}

cerebellum::Settings settings_of(const world::World& world) {
  cerebellum::Settings settings;
  for (std::size_t i = 0; i < world.zones.size(); ++i) settings.zone_speed_share[i] = world.zones[i].speed_share;
  return settings;
}

// On a computer shared with others a bridge tick comes late by tens of milliseconds.
constexpr Duration kRealTimeLead = std::chrono::milliseconds(60);

}  // namespace

Expected<std::unique_ptr<Assembly>> Assembly::build(world::World world, const world::Manifest& manifest,
                                                    const AssemblyOptions& options) {
  std::unique_ptr<Assembly> self(new Assembly(std::move(world)));
  auto model = model::RobotModel::load(self->world.robot);
  if (!model) return std::unexpected(model.error());
  auto simulation = sim::Simulation::create(self->world, manifest, options.seed);
  if (!simulation) return std::unexpected(simulation.error());
  self->simulation = std::move(*simulation);
  self->simulation->expect_visits(options.visits);
  if (options.arm_at) self->simulation->set_arm(*options.arm_at);
  const cerebellum::Settings settings = settings_of(self->world);
  if (auto good = cerebellum::check(*model, settings); !good) return std::unexpected(good.error());
  const bool realtime = options.pace == runner::Pace::kRealTime;
  self->cerebellum = std::make_unique<cerebellum::Cerebellum>(model->copy(), settings, Time{});
  self->perception = std::make_unique<perception::Perception>(
      self->world, model->copy(),
      [&helper = self->helper](const auto& first, const auto& second) { helper.both(first, second); });
  self->cell = std::make_unique<skills::Cell>(self->bridge_end, self->world, std::move(*model),
                                              realtime ? kRealTimeLead : skills::kSpliceLead);
  self->rest = std::make_unique<skills::Rest>(*self->cell);
  skills::add_skills(self->registry, *self->cell);
  if (auto good = check_resources(self->registry, self->world); !good) return std::unexpected(good.error());

  // Before the journal: a run that is refused leaves none behind.
  std::unique_ptr<gate::LocalSocket> socket;
  if (options.socket) {
    auto listening = gate::LocalSocket::listen(*options.socket);
    if (!listening) return std::unexpected(listening.error());
    socket = std::move(*listening);
  }
  auto journal = bridge::Journal::open(options.journal);
  if (!journal) return std::unexpected(journal.error());
  const auto counts = (*journal)->counts();
  if (!counts) return std::unexpected(counts.error());
  if (counts->accepted > 0) {
    return fail("holds an earlier run", options.journal.string(),
                "name another file for --journal, or move this one away");
  }
  self->journal = std::move(*journal);
  self->bridge = std::make_unique<bridge::Bridge>(*self->journal, self->registry, self->world);
  self->dispatcher = std::make_unique<brain::Dispatcher>(orders_of(manifest), self->world);

  if (socket) self->desk = std::make_unique<Desk>(std::move(socket), *self->bridge, *self->journal);
  self->crew =
      std::make_unique<runner::CameraCrew>(self->world, self->simulation->cameras(), *self->perception, options.pace);
  std::function<void(Time)> visitors;
  if (self->desk) visitors = [desk = self->desk.get()](Time now) { desk->attend(now); };
  self->bridge_side = std::make_unique<runner::BridgeSide>(*self->bridge, *self->dispatcher, self->skill_port(),
                                                           self->world.zones, options.recovery, visitors);
  return self;
}

runner::SkillPort Assembly::skill_port() {
  return {.refresh = [this](Time now, std::vector<ObjectBelief> objects) { cell->refresh(now, std::move(objects)); },
          .state = [this]() -> const link::State& { return cell->arm.state(); },
          .take_forgotten = [this] { return cell->take_forgotten(); },
          .arm = [this](Time now) { cell->arm.arm(now); },
          .outside_rad = [this] { return cell->arm.outside_rad(); },
          .recover = [this](Time now) { return cell->arm.recover(now); },
          .rest = [this](Time now) { rest->tick(now); }};
}

runner::Parts Assembly::parts() {
  return {.plant = {.body = &simulation->body(),
                    .cameras = simulation->cameras(),
                    .advance = [this](Time now) { simulation->advance_to(now); },
                    .finished = [this] { return simulation->finished(); },
                    .health = [this] { return simulation->health(); }},
          .cerebellum = cerebellum.get(),
          .link = &cerebellum_end,
          .bridge_side = bridge_side.get(),
          .crew = crew.get()};
}

}  // namespace pons::apps
