#include "apps/assembly.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <utility>

#include "apps/cell_facts.hpp"
#include "apps/outside.hpp"
#include "apps/policies.hpp"
#include "apps/resources.hpp"
#include "apps/visitors.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/journal/story.hpp"
#include "pons/rt/clock.hpp"
#include "pons/rt/shared_memory.hpp"
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

// Whose bridge wrote this journal last, {"body", "link"}; empty in one that no bridge of such a body has opened.
Expected<task::Json> body_in(const bridge::Journal& journal) {
  auto body = task::Json::object();
  const auto read = journal.each_note([&body](const bridge::Event& event) -> Expected<void> {
    if (event.kind == kAttached) body = event.detail;
    return {};
  });
  if (!read) return std::unexpected(read.error());
  return body;
}

// Empty: there is none.
std::string link_that_lives(const task::Json& body) {
  std::string link = task::text_of(body, "link");
  return !link.empty() && rt::SharedMemory::is_owned(link) ? link : "";
}

task::Json json_of(const skills::Stray& stray) {
  task::Json json{{"code", stray.code}, {"fell_into", stray.place}};
  if (!stray.counted) json["counted"] = false;
  return json;
}

}  // namespace

Expected<std::string> link_that_lives(const bridge::Journal& journal) {
  const auto body = body_in(journal);
  if (!body) return std::unexpected(body.error());
  return link_that_lives(*body);
}

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
  auto self = std::make_unique<BodyHalf>();
  self->settings = settings_of(world);
  const auto stations = world.arms();
  for (std::size_t i = 0; i < stations.size(); ++i) {
    auto model = model::RobotModel::load(stations[i].robot);
    if (!model) return std::unexpected(model.error());
    if (auto good = cerebellum::check(*model, self->settings); !good) return std::unexpected(good.error());
    self->arms.push_back(std::make_unique<Arm>(stations.size() > 1 ? stations[i].arm : std::string(), *meeting.links[i],
                                               std::move(*model), self->settings));
  }
  auto simulation = sim::Simulation::create(world, manifest, setup.seed, setup.faults);
  if (!simulation) return std::unexpected(simulation.error());
  self->faults = setup.faults;
  self->stays = setup.stays;
  self->simulation = std::move(*simulation);
  self->simulation->lend(
      [half = self.get()](const auto& first, const auto& second) { half->helper.both(first, second); });
  self->simulation->expect_visits(setup.visits);
  if (setup.arm_at) self->simulation->set_arm(*setup.arm_at);
  self->photographer = std::make_unique<runner::Photographer>(world, self->simulation->cameras(), meeting.frames,
                                                              meeting.pages, meeting.pixels, meeting.pace);
  return self;
}

cerebellum::Statistics BodyHalf::Arm::statistics() const {
  cerebellum::Statistics all = before;
  all.add(cerebellum->statistics());
  return all;
}

void BodyHalf::replace_loops(Time now) {
  for (const auto& arm : arms) {
    arm->before = arm->statistics();
    arm->cerebellum.emplace(arm->model.copy(), settings, now - runner::kControlPeriod);
    arm->end.take_over();
  }
}

runner::BodyParts BodyHalf::parts() {
  std::vector<runner::RobotParts> robots;
  for (std::size_t i = 0; i < arms.size(); ++i)
    robots.push_back({arms[i]->name, &simulation->body(i), &*arms[i]->cerebellum, &arms[i]->end});
  return {.plant = {.cameras = simulation->cameras(),
                    .advance = [this](Time now) { simulation->advance_to(now); },
                    .finished = [this] { return !stays && simulation->finished(); },
                    .health = [this] { return simulation->health(); }},
          .robots = std::move(robots),
          .photographer = photographer.get()};
}

// ---- above it ----

Expected<std::unique_ptr<BridgeHalf>> BridgeHalf::build(const world::World& world, const world::Manifest& manifest,
                                                        const BridgeOptions& options, const Meeting& meeting) {
  auto self = std::make_unique<BridgeHalf>();
  if (auto added = self->add_arms(world, meeting); !added) return std::unexpected(added.error());
  const bool realtime = meeting.pace == runner::Pace::kRealTime;
  const task::SkillRegistry& registry = self->arms.front()->registry;
  bridge::tree::Library trees(registry);
  if (auto loaded = trees.load(world.folder / "trees"); !loaded) return std::unexpected(loaded.error());
  std::vector<const skills::Cell*> cells;
  for (const auto& arm : self->arms) cells.push_back(&arm->cell);
  auto rules = bridge::Rules::compile(world.review, registry, facts_of(std::move(cells), orders_of(manifest)));
  if (!rules) return std::unexpected(rules.error());
  // Before the journal: a run that is refused leaves none behind.
  std::unique_ptr<gate::LocalSocket> socket;
  if (options.socket) {
    auto listening = gate::LocalSocket::listen(*options.socket);
    if (!listening) return std::unexpected(listening.error());
    socket = std::move(*listening);
  }
  if (auto opened = self->open_sinks(world, options); !opened) return std::unexpected(opened.error());
  if (auto opened = self->open_journal(options); !opened) return std::unexpected(opened.error());
  if (realtime) self->journal->time_commits([clock = std::make_shared<rt::MonotonicClock>()] { return clock->now(); });
  self->bridge = std::make_unique<bridge::Bridge>(*self->journal, registry, world);
  for (std::size_t i = 1; i < self->arms.size(); ++i) self->bridge->add_robot(self->arms[i]->registry);
  self->bridge->use_trees(std::move(trees));
  self->bridge->use_rules(*std::move(rules), bridge::Contradictions(world.review.contradictions));
  if (self->arms.size() == 1) {
    skills::Cell& cell = self->cell();
    self->servoed_.emplace(*self->bridge, "servo", cell.world.arm);
    cell.is_waited_for = [half = self->bridge.get(), arm = cell.world.arm] { return half->is_waited_for(arm); };
  }
  brain::Brain& brain = self->add_brain(world, manifest, options);

  if (auto added = self->add_observer(world, meeting); !added) return std::unexpected(added.error());
  if (realtime) {
    self->inference = std::make_unique<runner::Thinker>();
  } else {
    self->inference = std::make_unique<brain::PromptInference>();
  }
  self->policies =
      std::make_unique<brain::PolicyRunner>(policies_of(self->cell().world, self->cell().model), *self->inference);
  const auto visitors = [half = self.get()](Time now) {
    half->policies->attend(half->cell().stream, now);
    half->show(now);
    if (half->desk) half->desk->attend(now);
  };
  self->bridge_side = std::make_unique<runner::BridgeSide>(*self->bridge, brain, self->skill_ports(), world,
                                                           options.recovery, visitors);
  self->bridge_side->keep_free(options.keep_free);
  if (options.faults != nullptr && options.faults->stalls) self->bridge_side->stall_brain(*options.faults->stalls);
  if (self->outlets.needed()) {
    if (auto opened = self->open_views(world, options); !opened) return std::unexpected(opened.error());
  }
  if (socket || self->ros || !options.visitors.empty()) {
    if (self->ros) self->ros->start();
    auto asked = together(std::move(socket), options.visitors);
    if (self->ros) asked = self->ros->visitors(std::move(asked));
    self->desk =
        std::make_unique<Desk>(std::move(asked), *self->bridge, *self->journal, self->bridge_side->armings(),
                               self->bridge_side->health(), [half = self.get()] { return half->cell().stream; });
    self->desk->serve(*self->bridge_side);
    self->desk->serve(Desk::Axes{
        self->cell().model.axis_names(), [&cell = self->cell()]() -> const link::State& { return cell.arm.state(); },
        [half = self.get()](const AxisVector& position, Time now) { return half->servo(position, now); }});
  }
  return self;
}

// Somebody may look on.
Expected<void> BridgeHalf::add_observer(const world::World& world, const Meeting& meeting) {
  perception::Sight* sight = perception.get();
  if (outlets.needed()) {
    auto opened = CamerasView::open(outlets, world, *perception, meeting.pace);
    if (!opened) return std::unexpected(opened.error());
    cameras = *std::move(opened);
    sight = cameras.get();
  }
  observer =
      std::make_unique<runner::Observer>(world, *sight, meeting.frames, meeting.pages, meeting.pixels, meeting.pace);
  return {};
}

void BridgeHalf::show(Time now) {
  if (cameras) cameras->show(now);
  for (const auto& view : views) view->show(now);
}

void BridgeHalf::say(std::uint8_t level, Time at, std::string_view line) {
  if (run_views_ != nullptr) run_views_->say(level, at, line);
}

Expected<void> BridgeHalf::add_arms(const world::World& world, const Meeting& meeting) {
  const bool realtime = meeting.pace == runner::Pace::kRealTime;
  auto served = gate::ros::OutsideSkills::compile(world.outside_skills, interface_folders(world));
  if (!served) return std::unexpected(served.error());
  outside = *std::move(served);
  const auto stations = world.arms();
  for (std::size_t i = 0; i < stations.size(); ++i) {
    auto model = model::RobotModel::load(stations[i].robot);
    if (!model) return std::unexpected(model.error());
    if (perception) {
      perception->add_robot(model->copy());
    } else {
      perception = std::make_unique<perception::Perception>(
          world, model->copy(), [this](const auto& first, const auto& second) { helper.both(first, second); });
    }
    arms.push_back(std::make_unique<Arm>(*meeting.links[i], stations[i], std::move(*model),
                                         realtime ? kRealTimeLead : skills::kSpliceLead));
    // There is one stream of chunks at most, and it is the first arm's.
    skills::add_skills(arms[i]->registry, arms[i]->cell, policy_names());
    if (auto added = outside.add_to(arms[i]->registry); !added) return added;
    if (auto good = check_resources(arms[i]->registry, world); !good) return good;
  }
  for (const auto& one : arms) {
    for (const auto& other : arms) {
      if (other != one) one->cell.beside(other->cell);
    }
  }
  return {};
}

brain::Brain& BridgeHalf::add_brain(const world::World& world, const world::Manifest& manifest,
                                    const BridgeOptions& options) {
  dispatcher = std::make_unique<brain::Dispatcher>(orders_of(manifest), world);
  brain::Brain* brain = dispatcher.get();
  if (options.faults != nullptr && options.faults->network) {
    far_brain = std::make_unique<brain::FarBrain>(*brain, *options.faults->network);
    brain = far_brain.get();
  }
  if (options.faults != nullptr && options.faults->lies) {
    liar = std::make_unique<brain::Liar>(*brain, *options.faults->lies, world);
    brain = liar.get();
  }
  return *brain;
}

bool BridgeHalf::holds_something() const {
  return std::ranges::any_of(arms, [](const auto& arm) { return arm->cell.held.has_value(); });
}

Expected<void> BridgeHalf::open_journal(const BridgeOptions& options) {
  auto opened = bridge::Journal::open(options.journal);
  if (!opened) return std::unexpected(opened.error());
  const auto counts = (*opened)->counts();
  if (!counts) return std::unexpected(counts.error());
  const auto earlier = body_in(**opened);
  if (!earlier) return std::unexpected(earlier.error());
  const std::string body = options.body ? fmt::format("{:016x}", *options.body) : std::string();
  const bool may_follow = options.body && options.comes != BridgeOptions::Comes::kFirst;
  const bool taken_up = may_follow && task::text_of(*earlier, "body") == body;
  const bool used = !taken_up && (counts->accepted > 0 || !earlier->empty());
  const auto refused = [&](std::string_view why) {
    return fail(std::string(why), bridge::shown(options.journal),
                bridge::in_database(options.journal) ? "name another bridge, postgresql://…#NAME"
                                                     : "name another file for --journal, or move this one away");
  };
  if (used && !may_follow) return refused("holds an earlier run");
  if (used && !bridge::in_database(options.journal)) return refused("holds a run of another body");
  // Whoever has a link's name now follows on a body that had it; of another name, that one may live.
  if (const std::string link = link_that_lives(*earlier); used && !link.empty() && link != options.link)
    return refused(fmt::format("holds the run of a body that lives (--link {})", link));
  journal = std::move(*opened);
  if (!options.body) return {};
  // A bridge's name in a database is for good, and orders wait under it. What stood under the body before ends in the
  // commit that says that this one has come, or neither does.
  auto attached = used ? bridge::end_with_body(*journal, Time{}) : Expected<void>{};
  if (attached) attached = journal->note(Time{}, kAttached, {{"body", body}, {"link", options.link}});
  if (attached) attached = journal->commit();
  if (!attached) journal->abandon();
  return attached;
}

Expected<std::string> BridgeHalf::servo(const AxisVector& position, Time now) {
  if (!servoed_) return fail("no set-point says which arm it means", "servo", "ask in a world with one arm");
  if (!cell().arm.operational())
    return fail("the robot is not armed", "servo", "wait, or `pons robot` says what it needs");
  if (cell().held) return fail("the cups hold " + cell().held->code, "servo", "have it put down");
  if (cell().servo != nullptr) {
    if (auto going = cell().servo->take(position, now); !going) return std::unexpected(going.error());
    return bridge->mover(0);
  }
  auto taken = servoed_->take({{"positions", std::vector<double>(position.begin(), position.end())}}, now);
  if (!taken) return std::unexpected(taken.error());
  if (!taken->begun) return fail(taken->id + " is about to begin", "servo", "send it again");
  return std::move(taken->id);
}

void BridgeHalf::kill(std::unique_ptr<BridgeHalf> half) { half->journal->abandon(); }

std::vector<runner::SkillPort> BridgeHalf::skill_ports() {
  std::vector<runner::SkillPort> ports;
  for (std::size_t robot = 0; robot < arms.size(); ++robot) {
    auto& [end, cell, rest, take_up, registry] = *arms[robot];
    ports.push_back(
        {.name = cell.world.arm,
         .robot = robot,
         .refresh = [&cell](Time now, std::vector<ObjectBelief> objects,
                            Time seen) { cell.refresh(now, std::move(objects), seen); },
         .label = [&cell](std::vector<ObjectBelief>& objects) { cell.label(objects); },
         .unseen = [&cell] { return cell.left(); },
         .state = [&cell]() -> const link::State& { return cell.arm.state(); },
         .take_forgotten = [&cell] { return cell.take_forgotten(); },
         .take_strays =
             [&cell] {
               std::vector<task::Json> strays;
               for (const skills::Stray& stray : cell.strays->take_found_gone()) strays.push_back(json_of(stray));
               return strays;
             },
         .arm = [&cell](Time now) { cell.arm.arm(now); },
         .outside_rad = [&cell] { return cell.arm.outside_rad(); },
         .recover = [&cell](Time now) { return cell.arm.recover(now); },
         .rest = [&rest](Time now) { rest.tick(now); },
         .park = [&rest](Time now) { rest.park(now); },
         .grip = [&cell](const runner::Grip& grip) { cell.grip_share = grip.share, cell.lifts = grip.lifts; },
         .belt = [&cell](link::Belt wanted) { cell.arm.belt(wanted); },
         .holds_belt = [&cell](Time now) { return cell.holds_belt(now); },
         .halt = [&cell] { cell.arm.halt(); },
         .raise_emergency = [&end] { end.raise_emergency_stop(); },
         .release_emergency = [&end] { end.clear_emergency_stop(); },
         .carries = [&take_up]() -> const task::Json& { return take_up.carries(); },
         .takes_until_m = cell.world.belt.pick_x_max_m,
         .lets_pass = [&cell] { return cell.lets_pass(); },
         .restore = [&take_up](const task::Json& carried) { take_up.restore(carried); },
         .resume =
             [&take_up, this](const task::Task& task, std::size_t done) {
               const auto served = outside_resumption(outside, task, done);
               return served ? *served : resumption(take_up, task, done);
             },
         .settle = [&take_up](Time now) { return take_up.settle(now); }});
  }
  return ports;
}

// ---- both ----

Meeting Assembly::meeting() {
  std::vector<link::Link*> ends;
  for (const auto& link : links) ends.push_back(link.get());
  return {std::move(ends), darkroom.frames, darkroom.pages, darkroom.memory(), options_.pace};
}

Expected<std::unique_ptr<Assembly>> Assembly::build(world::World world, const world::Manifest& manifest,
                                                    const AssemblyOptions& options) {
  std::unique_ptr<Assembly> self(new Assembly(std::move(world), manifest, options));
  for (std::size_t i = 0; i < self->world.arms().size(); ++i) self->links.push_back(std::make_unique<link::Link>());
  auto body = BodyHalf::build(self->world, manifest, options.body, self->meeting());
  if (!body) return std::unexpected(body.error());
  self->body = std::move(*body);
  constexpr auto kCrash = world::Fault::kBridgeCrash;
  const world::FaultRate& crash = options.body.faults[kCrash];
  // By the clock, who wants that has two processes and kills one.
  if (options.pace == runner::Pace::kLockstep && crash.often > 0) {
    if (options.journal == ":memory:")
      return fail("a journal in memory dies with its bridge", "bridge_crash", "name a file for the journal");
    self->crashes_.emplace(
        world::Spells(crash, world::fault_stream(options.body.seed, kCrash)),
        [cell = self.get()] { cell->kill_above(); },
        [cell = self.get()](Time now) { return cell->replace_above(now); });
  }
  constexpr auto kLoopCrash = world::Fault::kLoopCrash;
  const world::FaultRate& loop_crash = options.body.faults[kLoopCrash];
  if (options.pace == runner::Pace::kLockstep && loop_crash.often > 0) {
    self->loop_crashes_.emplace(
        runner::Deaths(world::Spells(loop_crash, world::fault_stream(options.body.seed, kLoopCrash))),
        [half = self->body.get()](Time now) { half->replace_loops(now); });
  }
  if (auto built = self->build_above(BridgeOptions::Comes::kFirst); !built) return std::unexpected(built.error());
  return self;
}

Expected<void> Assembly::build_above(BridgeOptions::Comes comes) {
  BridgeOptions bridge{.journal = options_.journal,
                       .socket = options_.socket,
                       .ros = options_.ros,
                       .sinks = options_.sinks,
                       .visitors = options_.visitors,
                       .recovery = options_.recovery,
                       .keep_free = options_.keep_free,
                       .comes = comes,
                       .faults = &faults_};
  // Equal runs write equal journals.
  if (crashes_) bridge.body = options_.body.seed;
  auto built = BridgeHalf::build(world, manifest_, bridge, meeting());
  if (!built) return std::unexpected(built.error());
  above = std::move(*built);
  return {};
}

void Assembly::kill_above() {
  account_ = above->bridge_side->account();
  BridgeHalf::kill(std::move(above));
}

// As `pons bridge` does it.
Expected<runner::Above> Assembly::replace_above(Time now) {
  if (auto built = build_above(BridgeOptions::Comes::kFirstOrLater); !built) return std::unexpected(built.error());
  above->bridge_side->begin_with(account_, now);
  if (auto taken = above->bridge_side->take_over(*above->journal, now); !taken) return std::unexpected(taken.error());
  return runner::Above{above->bridge_side.get(), above->observer.get()};
}

void Assembly::count_injected(world::FaultCounts& counts) const {
  faults_.count(counts);
  if (crashes_) counts[world::Fault::kBridgeCrash] = crashes_->count();
  if (loop_crashes_) counts[world::Fault::kLoopCrash] = loop_crashes_->deaths.count();
}

runner::Parts Assembly::parts() {
  return {.body = body->parts(),
          .bridge_side = above->bridge_side.get(),
          .observer = above->observer.get(),
          .crashes = crashes_ ? &*crashes_ : nullptr,
          .loop_crashes = loop_crashes_ ? &*loop_crashes_ : nullptr};
}

}  // namespace pons::apps
