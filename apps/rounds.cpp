#include "apps/rounds.hpp"

#include <utility>

#include "apps/resources.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/review/review.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/rt/clock.hpp"

namespace pons::apps {
namespace {

// On a computer shared with others a bridge tick comes late by tens of milliseconds.
constexpr Duration kRealTimeLead = std::chrono::milliseconds(60);

}  // namespace

cerebellum::Settings wheel_settings() {
  cerebellum::Settings settings;
  // What rolls over a joint of the floor, or scrubs in a turn on the spot, is no collision: that of a bumper is.
  settings.collision.torque_share = 0.3;
  settings.collision.motion_share = 0.5;
  return settings;
}

Expected<std::unique_ptr<Rounds>> Rounds::build(world::World world, std::vector<brain::Errand> errands,
                                                const RoundsSetup& setup) {
  std::unique_ptr<Rounds> self(new Rounds(std::move(world), std::move(errands)));
  if (auto built = self->build_body(setup); !built) return std::unexpected(built.error());
  if (auto built = self->build_bridge(setup); !built) return std::unexpected(built.error());
  return self;
}

Expected<void> Rounds::build_body(const RoundsSetup& setup) {
  auto model = model::RobotModel::load(world.robot);
  if (!model) return std::unexpected(model.error());
  const cerebellum::Settings settings = wheel_settings();
  if (auto good = cerebellum::check(*model, settings); !good) return good;
  auto created = sim::BaseSimulation::create(world, setup.seed);
  if (!created) return std::unexpected(created.error());
  simulation = std::move(*created);
  cerebellum = std::make_unique<cerebellum::Cerebellum>(std::move(*model), settings, Time{});
  photographer = std::make_unique<runner::Photographer>(world, simulation->cameras(), darkroom.frames, darkroom.pages,
                                                        darkroom.memory(), setup.pace);
  return {};
}

Expected<void> Rounds::build_bridge(const RoundsSetup& setup) {
  const bool realtime = setup.pace == runner::Pace::kRealTime;
  chassis = std::make_unique<skills::Chassis>(bridge_end, world, realtime ? kRealTimeLead : skills::kSpliceLead);
  speaker = std::make_unique<runner::Speaker>(setup.speech, setup.pace);
  skills::add_base_skills(registry, *chassis, *speaker);
  if (auto good = check_resources(registry, world); !good) return good;
  bridge::tree::Library trees(registry);
  if (auto loaded = trees.load(world.folder / "trees"); !loaded) return loaded;
  if (auto good = review(trees); !good) return good;
  auto rules = bridge::Rules::compile(world.review, registry, {});
  if (!rules) return std::unexpected(rules.error());
  // Before the journal: a run that is refused leaves none behind.
  std::unique_ptr<gate::LocalSocket> socket;
  if (setup.socket) {
    auto listening = gate::LocalSocket::listen(*setup.socket);
    if (!listening) return std::unexpected(listening.error());
    socket = std::move(*listening);
  }
  auto opened = bridge::Journal::open(setup.journal);
  if (!opened) return std::unexpected(opened.error());
  const auto counts = (*opened)->counts();
  if (!counts) return std::unexpected(counts.error());
  if (counts->accepted > 0)
    return fail("holds an earlier run", bridge::shown(setup.journal),
                "name another file for --journal, or move this one away");
  journal = std::move(*opened);
  if (realtime) journal->time_commits([clock = std::make_shared<rt::MonotonicClock>()] { return clock->now(); });
  bridge = std::make_unique<bridge::Bridge>(*journal, registry, world);
  bridge->use_trees(std::move(trees));
  bridge->use_rules(*std::move(rules), bridge::Contradictions(world.review.contradictions));
  observer = std::make_unique<runner::Observer>(world, localiser, darkroom.frames, darkroom.pages, darkroom.memory(),
                                                setup.pace);
  bridge_side = std::make_unique<runner::BridgeSide>(*bridge, errands, skill_ports(), world, runner::Recovery::kRefused,
                                                     [this](Time now) {
                                                       if (desk) desk->attend(now);
                                                     });
  bridge_side->keep_free(setup.keep_free);
  if (socket) {
    desk = std::make_unique<Desk>(std::move(socket), *bridge, *journal, bridge_side->armings(), bridge_side->health(),
                                  []() -> task::ChunkStream* { return nullptr; });
  }
  return {};
}

// What nobody could do is told before the run rather than in it.
Expected<void> Rounds::review(const bridge::tree::Library& trees) const {
  std::vector<std::string> resources;
  for (const world::Resource& resource : world.resources) resources.push_back(resource.name);
  bridge::Review review(registry, std::move(resources));
  review.use_trees(trees);
  for (const brain::Errand& errand : errands.all()) {
    const auto task = task::task_from(errand.task);
    if (!task) return std::unexpected(task.error());
    const auto refused = [&](Error error) {
      error.where = task->id + error.where;
      return std::unexpected(std::move(error));
    };
    const auto program = review.check(*task, errand.at);
    if (!program) return refused(program.error());
    if (auto asked = review.judge(*task, bridge::Review::uses(*task, program->get())); !asked)
      return refused(asked.error());
  }
  return {};
}

std::vector<runner::SkillPort> Rounds::skill_ports() {
  skills::Arm& wheels = chassis->wheels;
  return {{.name = "base",
           .refresh = [this](Time now, const std::vector<ObjectBelief>&, Time) { chassis->refresh(now); },
           .locate = [this](const BaseBelief& belief) { chassis->locate(belief); },
           .state = [&wheels]() -> const link::State& { return wheels.state(); },
           .take_forgotten = [] { return std::vector<std::uint32_t>{}; },
           .arm = [&wheels](Time now) { wheels.arm(now); },
           .outside_rad = [&wheels] { return wheels.outside_rad(); },
           .recover = [&wheels](Time now) { return wheels.recover(now); },
           .rest = [](Time) {},
           .belt = [](link::Belt) {},
           .halt = [&wheels] { wheels.halt(); },
           .raise_emergency = [this] { bridge_end.raise_emergency_stop(); },
           .release_emergency = [this] { bridge_end.clear_emergency_stop(); },
           .carries = [] { return bridge::Json{}; },
           .restore = [](const bridge::Json&) {},
           .resume =
               [](const task::Task&, std::size_t done) {
                 return bridge::Resumption{done, task::Outcome::kFailed, "its bridge was ended in the middle of it"};
               },
           .settle = [](Time) { return true; }}};
}

runner::Parts Rounds::parts() {
  return {.body = {.plant = {.cameras = simulation->cameras(),
                             .advance = [this](Time now) { simulation->advance_to(now); },
                             .finished = [] { return true; },  // nothing comes by itself
                             .health = [this] { return simulation->health(); }},
                   .robots = {{{}, &simulation->body(), cerebellum.get(), &body_end}},
                   .photographer = photographer.get()},
          .bridge_side = bridge_side.get(),
          .observer = observer.get()};
}

}  // namespace pons::apps
