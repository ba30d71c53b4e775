// pons doctor: tries what a run needs, instead of asking whether it is there.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <numbers>

#include "apps/assembly.hpp"
#include "apps/commands.hpp"
#include "apps/doctor.hpp"
#include "apps/outside.hpp"
#include "apps/paths.hpp"
#include "apps/rounds.hpp"
#include "apps/run_kit.hpp"
#include "pons/gate/ros/outside_skill.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/skills/base/way.hpp"
#include "pons/skills/cell.hpp"
#include "pons/world/faults.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

Finding say(Finding finding, std::string_view what, std::string_view how) {
  constexpr const char* kWords[] = {"good", "slow", "bad"};
  say(stdout, fmt::format("{:<5} {:<26} {}\n", kWords[static_cast<int>(finding)], what, how));
  std::fflush(stdout);  // a minute passes before the last line
  return finding;
}

namespace {

constexpr double kMatched = 0.6;  // of a scan: the rest is what the map does not show

// Where the tool must get: over each mouth, and to the belt at both ends of the pick zone. Empty, or what it does not
// reach.
std::string out_of_reach(const world::World& world, model::RobotModel& model) {
  constexpr double kOverMouth_m = 0.15, kOverBelt_m = 0.02;
  std::vector<std::pair<std::string, Vector3>> points;
  for (const world::Place& place : world.places) {
    if (place.kind == world::PlaceKind::kChute)
      points.emplace_back(place.name, place.center_m + Vector3(0, 0, kOverMouth_m));
  }
  const world::Belt& belt = world.belt;
  for (const double x : {belt.pick_x_min_m, belt.pick_x_max_m})
    points.emplace_back(fmt::format("the belt at x = {} m", x),
                        Vector3(x, belt.y_center_m, belt.surface_z_m + kOverBelt_m));
  std::vector<std::string> names;
  for (const auto& [name, point] : points) {
    const bool reached = std::ranges::any_of(std::array{0.0, 0.5, 1.0, 1.5}, [&](double half_turns) {
      return model.inverse(skills::Cell::tip_down(point, half_turns * std::numbers::pi), world.robot.home).has_value();
    });
    if (!reached) names.push_back(name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// Whether a base finds a way from where it starts to each station.
std::string no_way_to(const world::World& world) {
  const skills::Floor floor(*world.map, *world.base);
  std::vector<std::string> names;
  for (const world::Station& station : world.base->stations) {
    skills::WaySearch search(floor, world.base->start.position(), station.map_from_base.position());
    auto found = search.go_on(world.map->width() * world.map->height() * 8);
    if (!found || !*found) names.push_back(station.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

// All that a run reads of its files. Of a base there is no manifest.
Expected<void> try_files(const world::World& world, const world::Manifest* manifest) {
  for (const std::string& plan : world::fault_plans(world)) {
    if (auto read = world::load_faults(world, plan); !read) return std::unexpected(read.error());
  }
  const TemporaryFolder folder;
  const auto journal = folder.file("journal.db"), speech = folder.file(".");
  if (!journal || !speech) return std::unexpected((journal ? speech : journal).error());
  if (manifest == nullptr) {
    auto built = Rounds::build(world, {}, {.journal = *journal, .speech = *speech});
    return built ? Expected<void>() : std::unexpected(built.error());
  }
  auto built = Assembly::build(world, *manifest, {.journal = *journal});
  return built ? Expected<void>() : std::unexpected(built.error());
}

Finding try_base(const std::string& what, const world::World& world) {
  const auto model = model::RobotModel::load(world.robot);
  if (!model) return say(Finding::kBad, what, model.error().line());
  if (auto good = cerebellum::check(*model, wheel_settings()); !good)
    return say(Finding::kBad, what, good.error().line());
  const auto simulation = sim::BaseSimulation::create(world, 1);
  if (!simulation) return say(Finding::kBad, what, simulation.error().line());
  RgbdFrame scan;
  body::Camera* const lidar = (*simulation)->cameras().front();
  lidar->begin(Time{});
  if (auto taken = lidar->finish(scan); !taken) return say(Finding::kBad, what, taken.error().line());
  perception::Localiser localiser(world);
  localiser.process(scan, {AxisVector::Zero(2), 0});
  if (const double matched = localiser.base()->matched; matched < kMatched)
    return say(Finding::kBad, what, fmt::format("{:.0f} % of a scan is on the map; draw it anew", 100 * matched));
  if (const std::string names = no_way_to(world); !names.empty())
    return say(Finding::kBad, what, fmt::format("no way leads to {}; move it, or mend the map", names));
  if (auto read = try_files(world, nullptr); !read) return say(Finding::kBad, what, read.error().line());
  return say(Finding::kGood, what,
             fmt::format("composes, its scan fits the map, and ways lead to {} stations", world.base->stations.size()));
}

// The same program and way as a run's.
Finding try_speech() {
  const TemporaryFolder folder;
  const auto file = folder.file(".");
  if (!file) return say(Finding::kBad, "speech", file.error().line());
  runner::Speaker speaker(*file, runner::Pace::kLockstep);
  if (auto begun = speaker.begin("good", Time{}); !begun) return say(Finding::kBad, "speech", begun.error().line());
  const auto spoken = speaker.look(Time(std::chrono::hours(1)));
  if (!spoken || !*spoken) return say(Finding::kBad, "speech", spoken ? spoken->error().line() : "says nothing");
  return say(Finding::kGood, "speech", "espeak-ng speaks");
}

Finding try_world(const std::string& name) {
  const std::string what = "world " + name;
  const auto world = world::load(worlds_folder(), name);
  if (!world) return say(Finding::kBad, what, world.error().line());
  if (auto served = gate::ros::OutsideSkills::compile(world->outside_skills, interface_folders(*world)); !served)
    return say(Finding::kBad, what, served.error().line());
  if (world->base) return std::max(try_base(what, *world), try_speech());
  const auto manifest = world::draw_manifest(*world, 1, 1);
  if (!manifest) return say(Finding::kBad, what, manifest.error().line());
  const auto simulation = sim::Simulation::create(*world, *manifest, 1);
  if (!simulation) return say(Finding::kBad, what, simulation.error().line());
  RgbdFrame frame;
  for (body::Camera* camera : (*simulation)->cameras()) {
    camera->begin(Time{});
    if (auto taken = camera->finish(frame); !taken) return say(Finding::kBad, what, taken.error().line());
  }
  const auto stations = world->arms();
  for (const world::World& station : stations) {
    auto model = model::RobotModel::load(station.robot);
    if (!model) return say(Finding::kBad, what, model.error().line());
    if (const std::string far = out_of_reach(station, *model); !far.empty())
      return say(Finding::kBad, what,
                 fmt::format("the tool of '{}' does not reach {}; move it, or the robot", station.arm, far));
  }
  if (auto read = try_files(*world, &*manifest); !read) return say(Finding::kBad, what, read.error().line());
  return say(Finding::kGood, what,
             fmt::format("composes, {}, and {} cameras render",
                         stations.size() == 1 ? "the arm reaches" : fmt::format("{} arms reach", stations.size()),
                         world->cameras.size()));
}

int doctor(double jitter_s) {
  Finding worst = Finding::kGood;
  const auto note = [&](Finding finding) { worst = std::max(worst, finding); };
  const auto folder = worlds_folder();
  const auto names = world::list(folder);
  if (names.empty()) note(say(Finding::kBad, "worlds", fmt::format("none in {}: set PONS_WORLDS", folder.string())));
  for (const std::string& name : names) note(try_world(name));
  note(try_realtime(from_s(jitter_s)));
  if (worst == Finding::kDegraded) fmt::print("Everything works; --realtime will be less regular than it could be.\n");
  return worst == Finding::kBad ? kExitBadInput : kExitGood;
}

}  // namespace

void add_doctor(CLI::App& app, Chosen& chosen) {
  auto jitter_s = std::make_shared<double>(60);
  CLI::App* command = app.add_subcommand("doctor", "Try what a run needs on this machine");
  command->add_option("--jitter", *jitter_s, "Seconds to measure the control loop's regularity for; 0: not (60)")
      ->check(CLI::Range(0.0, 86400.0));
  command->callback([jitter_s, &chosen] { chosen = [jitter_s] { return doctor(*jitter_s); }; });
}

}  // namespace pons::apps
