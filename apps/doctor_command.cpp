// pons doctor: tries what a run needs, instead of asking whether it is there.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <sys/mman.h>
#include <algorithm>
#include <array>
#include <numbers>

#include "apps/commands.hpp"
#include "apps/paths.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/skills/cell.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {
namespace {

enum class Finding : std::uint8_t { kGood, kDegraded, kBad };

Finding say(Finding finding, std::string_view what, std::string_view how) {
  constexpr const char* kWords[] = {"good", "slow", "bad"};
  fmt::print("{:<5} {:<22} {}\n", kWords[static_cast<int>(finding)], what, how);
  return finding;
}

Finding try_realtime_priority() {
  pthread_t self = pthread_self();
  int policy = 0;
  sched_param before{}, wanted{};
  pthread_getschedparam(self, &policy, &before);
  wanted.sched_priority = 80;
  const int refused = pthread_setschedparam(self, SCHED_FIFO, &wanted);
  pthread_setschedparam(self, policy, &before);
  if (refused == 0) return say(Finding::kGood, "real-time priority", "SCHED_FIFO granted");
  return say(Finding::kDegraded, "real-time priority",
             "SCHED_FIFO refused: sudo setcap cap_sys_nice,cap_ipc_lock+ep $(which pons)");
}

Finding try_locked_memory() {
  constexpr std::size_t kBytes = 1U << 20U;
  void* page = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  const bool locked = page != MAP_FAILED && mlock(page, kBytes) == 0;
  if (page != MAP_FAILED) munmap(page, kBytes);
  if (locked) return say(Finding::kGood, "locked memory", "granted");
  return say(Finding::kDegraded, "locked memory", "refused: sudo setcap cap_sys_nice,cap_ipc_lock+ep $(which pons)");
}

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

Finding try_world(const std::string& name) {
  const std::string what = "world " + name;
  const auto world = world::load(worlds_folder(), name);
  if (!world) return say(Finding::kBad, what, world.error().line());
  auto model = model::RobotModel::load(world->robot);
  if (!model) return say(Finding::kBad, what, model.error().line());
  const auto manifest = world::draw_manifest(*world, 1, 1);
  if (!manifest) return say(Finding::kBad, what, manifest.error().line());
  const auto simulation = sim::Simulation::create(*world, *manifest, 1);
  if (!simulation) return say(Finding::kBad, what, simulation.error().line());
  RgbdFrame frame;
  for (body::Camera* camera : (*simulation)->cameras()) {
    camera->begin(Time{});
    if (auto taken = camera->finish(frame); !taken) return say(Finding::kBad, what, taken.error().line());
  }
  if (const std::string far = out_of_reach(*world, *model); !far.empty())
    return say(Finding::kBad, what, fmt::format("the tool does not reach {}; move it, or the robot", far));
  return say(Finding::kGood, what,
             fmt::format("composes, the arm reaches, and {} cameras render", world->cameras.size()));
}

int doctor() {
  Finding worst = Finding::kGood;
  const auto note = [&](Finding finding) { worst = std::max(worst, finding); };
  const auto folder = worlds_folder();
  const auto names = world::list(folder);
  if (names.empty()) note(say(Finding::kBad, "worlds", fmt::format("none in {}: set PONS_WORLDS", folder.string())));
  for (const std::string& name : names) note(try_world(name));
  note(try_realtime_priority());
  note(try_locked_memory());
  if (worst == Finding::kDegraded) fmt::print("Everything works; --realtime will be less regular than it could be.\n");
  return worst == Finding::kBad ? kExitBadInput : kExitGood;
}

}  // namespace

void add_doctor(CLI::App& app, Chosen& chosen) {
  app.add_subcommand("doctor", "Try what a run needs on this machine")->callback([&chosen] { chosen = doctor; });
}

}  // namespace pons::apps
