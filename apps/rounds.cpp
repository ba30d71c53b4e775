#include "apps/rounds.hpp"

#include <fmt/format.h>

#include <utility>

#include "apps/outside.hpp"
#include "apps/resources.hpp"
#include "apps/views/base_view.hpp"
#include "apps/views/clock_view.hpp"
#include "apps/views/frames.hpp"
#include "apps/views/link_view.hpp"
#include "apps/views/pose_view.hpp"
#include "apps/visitors.hpp"
#include "pons/bridge/journal/place.hpp"
#include "pons/bridge/review/review.hpp"
#include "pons/gate/local_socket.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/rt/clock.hpp"

namespace pons::apps {
namespace {

// On a computer shared with others a bridge tick comes late by tens of milliseconds.
constexpr Duration kRealTimeLead = std::chrono::milliseconds(60);
constexpr std::string_view kBase = "base";  // the resource of who drives

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
  self->ends_ = setup.ends;
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
  skills::add_base_skills(registry, *chassis, *speaker, [this] { return bridge->is_waited_for(kBase); });
  auto served = gate::ros::OutsideSkills::compile(world.outside_skills, interface_folders(world));
  if (!served) return std::unexpected(served.error());
  outside = *std::move(served);
  if (auto added = outside.add_to(registry); !added) return added;
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
  if (auto opened = open_ros(setup); !opened) return opened;
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
  steered_.emplace(*bridge, "drive", std::string(kBase));
  bridge->use_trees(std::move(trees));
  bridge->use_rules(*std::move(rules), bridge::Contradictions(world.review.contradictions));
  observer = std::make_unique<runner::Observer>(world, localiser, darkroom.frames, darkroom.pages, darkroom.memory(),
                                                setup.pace);
  bridge_side = std::make_unique<runner::BridgeSide>(*bridge, errands, skill_ports(), world, runner::Recovery::kRefused,
                                                     [this](Time now) {
                                                       show(now);
                                                       if (desk) desk->attend(now);
                                                     });
  bridge_side->keep_free(setup.keep_free);
  if (outlets.needed()) {
    if (auto shows = open_views(setup); !shows) return shows;
  }
  if (auto asked = together(std::move(socket), setup.visitors); asked || ros) open_desk(std::move(asked));
  return {};
}

// To whom it shows itself.
Expected<void> Rounds::open_ros(const RoundsSetup& setup) {
  if (setup.ros) {
    auto node = RosNode::open(*setup.ros);
    if (!node) return std::unexpected(node.error());
    ros = std::move(*node);
    if (auto served = ros->serve_parameters(world.name); !served) return served;
    if (auto connected = ros->connect(outside); !connected) return connected;
    if (auto speaks = ros->speak(world.dialects, registry); !speaks) return speaks;
    if (auto served = ros->serve_base(world.outside_skills); !served) return served;
    outlets.add(*ros);
  }
  for (Sink* const sink : setup.sinks) outlets.add(*sink);
  return {};
}

// What it shows, to all who are there by now.
Expected<void> Rounds::open_views(const RoundsSetup& setup) {
  auto model = model::RobotModel::load(world.robot);
  if (!model) return std::unexpected(model.error());
  auto base = BaseView::open(outlets, *chassis, std::move(*model));
  if (!base) return std::unexpected(base.error());
  views.push_back(std::move(*base));
  auto clock = ClockView::open(outlets);
  if (!clock) return std::unexpected(clock.error());
  views.push_back(std::move(*clock));
  auto pose = PoseView::open(outlets, *chassis);
  if (!pose) return std::unexpected(pose.error());
  views.push_back(std::move(*pose));
  auto links = LinkView::open(outlets, {{.name = {},
                                         .hand = &chassis->wheels,
                                         .frame = std::string(kMapFrame),
                                         .axes = static_cast<std::size_t>(world.robot.home.size())}});
  if (!links) return std::unexpected(links.error());
  views.push_back(std::move(*links));
  const gate::ros::NodeName name = setup.ros ? setup.ros->name : gate::ros::NodeName{"/", "pons"};
  HealthView::Sources health{.node = name.name,
                             .hardware = world.name,
                             .health = &bridge_side->health(),
                             .loops = {{"", [this]() -> const link::State& { return chassis->wheels.state(); }}},
                             .ways_out = outlets.ways_out()};
  auto run = RunViews::open(outlets, *bridge, name, std::move(health));
  if (!run) return std::unexpected(run.error());
  run_views_ = run->get();
  views.push_back(std::move(*run));
  return {};
}

void Rounds::open_desk(std::unique_ptr<gate::Visitors> visitors) {
  if (ros) {
    ros->start();
    visitors = ros->visitors(std::move(visitors));
  }
  desk = std::make_unique<Desk>(std::move(visitors), *bridge, *journal, bridge_side->armings(), bridge_side->health(),
                                []() -> task::ChunkStream* { return nullptr; });
  desk->serve(*bridge_side);
  desk->serve(Desk::Base{
      .describe = [this](Time now) { return describe(now); },
      .drive = [this](double ahead_m_s, double turn_rad_s, Time now) { return steer({ahead_m_s, turn_rad_s}, now); }});
}

Expected<std::string> Rounds::steer(const model::Twist2& twist, Time now) {
  if (!chassis->wheels.operational())
    return fail("the robot is not armed", "drive", "wait, or `pons robot` says what it needs");
  auto taken = steered_->take(bridge::Json::object(), now);
  if (!taken) return std::unexpected(taken.error());
  chassis->wish(twist, now);
  return std::move(taken->id);
}

void Rounds::show(Time now) {
  for (const auto& view : views) view->show(now);
}

void Rounds::say(std::uint8_t level, Time at, std::string_view line) {
  if (run_views_ != nullptr) run_views_->say(level, at, line);
}

bridge::Json Rounds::describe(Time now) const {
  const auto json_of = [](const Pose2& pose) { return bridge::Json{{"x", pose.x}, {"y", pose.y}, {"yaw", pose.yaw}}; };
  const link::State& state = chassis->wheels.state();
  const model::Twist2 twist = state.speed.size() == 2 ? chassis->drive.twist(state.speed) : model::Twist2{};
  bridge::Json heading;
  if (const auto& to = chassis->heading()) {
    heading = json_of(to->goal);
    heading.update({{"left_m", to->left_m}, {"detours", to->detours}});
  }
  Pose2 here = chassis->map_from_base();
  here.yaw = wrapped(here.yaw);
  return {{"ok", true},
          {"time_s", now.s()},
          {"pose", json_of(here)},
          {"sure", chassis->sure()},
          {"ahead_m_s", twist.ahead},
          {"turn_rad_s", twist.turn},
          {"heading", std::move(heading)}};
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
    if (auto given = bridge::Review::check_given(*task, program->get()); !given) return refused(given.error());
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
           .carries = []() -> const bridge::Json& {
             static const bridge::Json kNothing;
             return kNothing;
           },
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
                             .finished = [this] { return ends_ == RoundsSetup::Ends::kWithItsTasks; },
                             .health = [this] { return simulation->health(); }},
                   .robots = {{{}, &simulation->body(), cerebellum.get(), &body_end}},
                   .photographer = photographer.get()},
          .bridge_side = bridge_side.get(),
          .observer = observer.get()};
}

}  // namespace pons::apps
