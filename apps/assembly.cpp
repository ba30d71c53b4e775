#include "apps/assembly.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

#include "apps/cell_facts.hpp"
#include "apps/policies.hpp"
#include "apps/resources.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/rt/clock.hpp"
#include "pons/runner/thinker.hpp"

namespace pons::apps {
namespace {

// What a warehouse system would know in the morning: which code goes where, and how urgently. Not what a parcel weighs.
brain::Orders orders_of(const world::Manifest& manifest) {
  brain::Orders orders;
  for (const world::ManifestRow& row : manifest) orders[row.parcel_id] = {row.destination, row.priority};
  return orders;
}

cerebellum::Settings settings_of(const world::World& world) {
  cerebellum::Settings settings;
  for (std::size_t i = 0; i < world.zones.size(); ++i) settings.zone_speed_share[i] = world.zones[i].speed_share;
  return settings;
}

// On a computer shared with others a bridge tick comes late by tens of milliseconds.
constexpr Duration kRealTimeLead = std::chrono::milliseconds(60);

constexpr std::string_view kAttached = "attached";  // a bridge to a body; in the journal

// That of the body whose last bridge wrote this journal; empty in one that no bridge of such a body has opened.
Expected<std::string> body_in(const bridge::Journal& journal) {
  const auto events = journal.notes();
  if (!events) return std::unexpected(events.error());
  std::string body;
  for (const bridge::Event& event : *events) {
    if (event.kind == kAttached) body = task::text_of(event.detail, "body");
  }
  return body;
}

}  // namespace

bridge::Resumption resumption(const skills::TakeUp& take_up, const task::Task& task, std::size_t done) {
  using Fate = skills::TakeUp::Fate;
  switch (take_up.fate(task, done)) {
    case Fate::kGoesOn:
      return {.done = done};
    case Fate::kDone:
      return {.done = done + 1};
    case Fate::kAstray:
      return {done,
              task::Outcome::kException,
              "fell into " + take_up.fell_into() + " while no bridge lived",
              {{"fell_into", take_up.fell_into()}}};
    case Fate::kLost:
      return {done, task::Outcome::kFailed, "lost from the cups while no bridge lived"};
    case Fate::kBroken:
      return {done, task::Outcome::kFailed, "its bridge was ended in the middle of it"};
  }
  return {done, task::Outcome::kFailed, "unknown"};
}

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

// ---- below the link ----

Expected<std::unique_ptr<BodyHalf>> BodyHalf::build(const world::World& world, const world::Manifest& manifest,
                                                    const BodySetup& setup, const Meeting& meeting) {
  if (world.cameras.size() > link::kMaxCameras) {
    return fail(fmt::format("has {} cameras", world.cameras.size()), (world.folder / "world.yaml").string(),
                fmt::format("the link has places for {}", link::kMaxCameras));
  }
  std::unique_ptr<BodyHalf> self(new BodyHalf(meeting.link));
  auto model = model::RobotModel::load(world.robot);
  if (!model) return std::unexpected(model.error());
  const cerebellum::Settings settings = settings_of(world);
  if (auto good = cerebellum::check(*model, settings); !good) return std::unexpected(good.error());
  auto simulation = sim::Simulation::create(world, manifest, setup.seed, setup.faults);
  if (!simulation) return std::unexpected(simulation.error());
  self->faults = setup.faults;
  self->simulation = std::move(*simulation);
  self->simulation->expect_visits(setup.visits);
  if (setup.arm_at) self->simulation->set_arm(*setup.arm_at);
  self->cerebellum = std::make_unique<cerebellum::Cerebellum>(std::move(*model), settings, Time{});
  self->photographer = std::make_unique<runner::Photographer>(world, self->simulation->cameras(), meeting.frames,
                                                              meeting.pages, meeting.pixels, meeting.pace);
  return self;
}

runner::BodyParts BodyHalf::parts() {
  return {.plant = {.body = &simulation->body(),
                    .cameras = simulation->cameras(),
                    .advance = [this](Time now) { simulation->advance_to(now); },
                    .finished = [this] { return simulation->finished(); },
                    .health = [this] { return simulation->health(); }},
          .cerebellum = cerebellum.get(),
          .link = &end,
          .photographer = photographer.get()};
}

// ---- above it ----

Expected<std::unique_ptr<BridgeHalf>> BridgeHalf::build(const world::World& world, const world::Manifest& manifest,
                                                        const BridgeOptions& options, const Meeting& meeting) {
  std::unique_ptr<BridgeHalf> self(new BridgeHalf(meeting.link));
  auto model = model::RobotModel::load(world.robot);
  if (!model) return std::unexpected(model.error());
  const bool realtime = meeting.pace == runner::Pace::kRealTime;
  self->perception = std::make_unique<perception::Perception>(
      world, model->copy(),
      [&helper = self->helper](const auto& first, const auto& second) { helper.both(first, second); });
  self->cell = std::make_unique<skills::Cell>(self->end, world, std::move(*model),
                                              realtime ? kRealTimeLead : skills::kSpliceLead);
  self->rest = std::make_unique<skills::Rest>(*self->cell);
  self->take_up = std::make_unique<skills::TakeUp>(*self->cell);
  skills::add_skills(self->registry, *self->cell, policy_names());
  if (auto good = check_resources(self->registry, world); !good) return std::unexpected(good.error());

  bridge::tree::Library trees(self->registry);
  if (auto loaded = trees.load(world.folder / "trees"); !loaded) return std::unexpected(loaded.error());
  auto rules = bridge::Rules::compile(world.review, self->registry, facts_of(*self->cell, orders_of(manifest)));
  if (!rules) return std::unexpected(rules.error());
  // Before the journal: a run that is refused leaves none behind.
  std::unique_ptr<gate::LocalSocket> socket;
  if (options.socket) {
    auto listening = gate::LocalSocket::listen(*options.socket);
    if (!listening) return std::unexpected(listening.error());
    socket = std::move(*listening);
  }
  if (auto opened = self->open_journal(options); !opened) return std::unexpected(opened.error());
  if (realtime) self->journal->time_commits([clock = std::make_shared<rt::MonotonicClock>()] { return clock->now(); });
  self->bridge = std::make_unique<bridge::Bridge>(*self->journal, self->registry, world);
  self->bridge->use_trees(std::move(trees));
  self->bridge->use_rules(*std::move(rules), bridge::Contradictions(world.review.contradictions));
  self->dispatcher = std::make_unique<brain::Dispatcher>(orders_of(manifest), world);

  self->observer = std::make_unique<runner::Observer>(world, *self->perception, meeting.frames, meeting.pages,
                                                      meeting.pixels, meeting.pace);
  if (realtime) {
    self->inference = std::make_unique<runner::Thinker>();
  } else {
    self->inference = std::make_unique<brain::PromptInference>();
  }
  self->policies = std::make_unique<brain::PolicyRunner>(policies_of(world, self->cell->model), *self->inference);
  const auto visitors = [half = self.get()](Time now) {
    half->policies->attend(half->cell->stream, now);
    if (half->desk) half->desk->attend(now);
  };
  self->bridge_side = std::make_unique<runner::BridgeSide>(*self->bridge, *self->dispatcher, self->skill_port(), world,
                                                           options.recovery, visitors);
  self->bridge_side->keep_free(options.keep_free);
  if (socket) {
    self->desk =
        std::make_unique<Desk>(std::move(socket), *self->bridge, *self->journal, self->bridge_side->arming(),
                               self->bridge_side->health(), [half = self.get()] { return half->cell->stream; });
  }
  return self;
}

Expected<void> BridgeHalf::open_journal(const BridgeOptions& options) {
  auto opened = bridge::Journal::open(options.journal);
  if (!opened) return std::unexpected(opened.error());
  const auto counts = (*opened)->counts();
  if (!counts) return std::unexpected(counts.error());
  const auto earlier = body_in(**opened);
  if (!earlier) return std::unexpected(earlier.error());
  const std::string body = options.body ? fmt::format("{:016x}", *options.body) : std::string();
  const bool taken_up = options.body && *earlier == body;
  if (!taken_up && (counts->accepted > 0 || !earlier->empty())) {
    return fail(options.body ? "holds a run of another body" : "holds an earlier run", bridge::shown(options.journal),
                "name another file for --journal, or move this one away");
  }
  journal = std::move(*opened);
  if (!options.body) return {};
  if (auto noted = journal->note(Time{}, kAttached, {{"body", body}}); !noted) return noted;
  return journal->commit();
}

runner::SkillPort BridgeHalf::skill_port() {
  return {.refresh = [this](Time now, std::vector<ObjectBelief> objects,
                            Time seen) { cell->refresh(now, std::move(objects), seen); },
          .state = [this]() -> const link::State& { return cell->arm.state(); },
          .take_forgotten = [this] { return cell->take_forgotten(); },
          .arm = [this](Time now) { cell->arm.arm(now); },
          .outside_rad = [this] { return cell->arm.outside_rad(); },
          .recover = [this](Time now) { return cell->arm.recover(now); },
          .rest = [this](Time now) { rest->tick(now); },
          .park = [this](Time now) { rest->park(now); },
          .grip = [this](const runner::Grip& grip) { cell->grip_share = grip.share, cell->lifts = grip.lifts; },
          .belt = [this](link::Belt wanted) { cell->arm.belt(wanted); },
          .holds_belt = [this](Time now) { return cell->holds_belt(now); },
          .halt = [this] { cell->arm.halt(); },
          .raise_emergency = [this] { end.raise_emergency_stop(); },
          .release_emergency = [this] { end.clear_emergency_stop(); },
          .carries = [this] { return take_up->carries(); },
          .restore = [this](const task::Json& carried) { take_up->restore(carried); },
          .resume = [this](const task::Task& task, std::size_t done) { return resumption(*take_up, task, done); },
          .settle = [this](Time now) { return take_up->settle(now); }};
}

// ---- both ----

Expected<std::unique_ptr<Assembly>> Assembly::build(world::World world, const world::Manifest& manifest,
                                                    const AssemblyOptions& options) {
  std::unique_ptr<Assembly> self(new Assembly(std::move(world)));
  const Meeting meeting{self->link, self->darkroom.frames, self->darkroom.pages, self->darkroom.memory(), options.pace};
  auto body = BodyHalf::build(self->world, manifest, options.body, meeting);
  if (!body) return std::unexpected(body.error());
  self->body = std::move(*body);
  auto above =
      BridgeHalf::build(self->world, manifest,
                        {options.journal, options.socket, std::nullopt, options.recovery, options.keep_free}, meeting);
  if (!above) return std::unexpected(above.error());
  self->above = std::move(*above);
  const world::FaultRate& stalls = options.body.faults[world::Fault::kBrainStall];
  if (stalls.often > 0)
    self->above->bridge_side->stall_brain({stalls, world::fault_stream(options.body.seed, world::Fault::kBrainStall)});
  return self;
}

runner::Parts Assembly::parts() {
  return {.body = body->parts(), .bridge_side = above->bridge_side.get(), .observer = above->observer.get()};
}

}  // namespace pons::apps
