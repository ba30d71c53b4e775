// What the simulation costs beyond its physics: Simulation::advance_to against bare mj_step, with no frame taken and no
// control. A whole run of the cell is rehearsed first and its set-points are kept; then the same run is repeated from
// them, and in each stretch of it a bare copy takes the same steps from the same state with the same set-points.

#include <fmt/format.h>
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <span>
#include <vector>

#include "apps/assembly.hpp"
#include "apps/paths.hpp"
#include "pons/sim/bare_step.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/world/manifest.hpp"
#include "pons/world/world.hpp"

namespace {

using namespace pons;

constexpr double kBound = 1.2;
// Long enough for the timer, short enough that the copy, which is given no new parcels, stays with its original.
constexpr std::size_t kStretch = 50;  // control periods

template <typename T>
T must(Expected<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "simulation_step: {}\n", result.error().line());
  std::exit(2);
}

// Processor time of this thread: what others do on the machine is not ours.
double cpu_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// A body that knows what it was told last.
class Listener final : public body::Body {
 public:
  Listener(body::Body& body, Eigen::Index axes) : body_(body) { told_.torque_nm = AxisVector::Zero(axes); }
  void read(body::Sensors& sensors) PONS_NONBLOCKING override { body_.read(sensors); }
  void write(const body::SetPoints& set_points) PONS_NONBLOCKING override {
    told_ = set_points;
    body_.write(set_points);
  }
  [[nodiscard]] Duration watchdog() const override { return body_.watchdog(); }
  [[nodiscard]] const body::SetPoints& told() const { return told_; }

 private:
  body::Body& body_;
  body::SetPoints told_;
};

struct Rehearsal {
  std::vector<body::SetPoints> told;  // in force during each control period
  std::uint64_t state_digest = 0;     // at the end
};

Rehearsal rehearse(const world::World& world, const world::Manifest& manifest, std::uint64_t seed) {
  const auto cell = must(apps::Assembly::build(world, manifest, {.journal = ":memory:", .body = {.seed = seed}}));
  sim::Simulation& simulation = *cell->body->simulation;
  Listener listener(simulation.body(), world.robot.home.size());
  Rehearsal rehearsal;
  runner::Parts parts = cell->parts();
  parts.body.robots.front().body = &listener;
  parts.body.plant.advance = [&](Time now) {
    rehearsal.told.push_back(listener.told());
    simulation.advance_to(now);
  };
  (void)must(runner::run_lockstep(parts, {}));
  rehearsal.state_digest = simulation.state_digest();
  return rehearsal;
}

using Stretch = std::span<const body::SetPoints>;

// Processor time of the control periods from number `first` on.
template <typename Write, typename Advance>
double measure(Stretch told, std::size_t first, Write write, Advance advance) {
  const double began = cpu_us();
  for (const body::SetPoints& set_points : told) {
    write(set_points);
    advance(Time(runner::kControlPeriod * static_cast<std::int64_t>(++first)));
  }
  return cpu_us() - began;
}

double measure(sim::Simulation& simulation, Stretch told, std::size_t first) {
  return measure(
      told, first, [&](const body::SetPoints& set_points) { simulation.body().write(set_points); },
      [&](Time now) { simulation.advance_to(now); });
}

double measure(sim::BareStep& bare, Stretch told, std::size_t first) {
  return measure(
      told, first, [&](const body::SetPoints& set_points) { bare.write(set_points); },
      [&](Time now) { bare.advance_to(now); });
}

struct Cost {
  std::vector<double> us;  // of each stretch

  [[nodiscard]] double median() const {
    std::vector<double> sorted = us;
    std::sort(sorted.begin(), sorted.end());
    return sorted[sorted.size() / 2];
  }
  [[nodiscard]] double sum() const {
    double total = 0;
    for (const double one : us) total += one;
    return total;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int parcels = argc > 1 ? std::atoi(argv[1]) : 20;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);
  const world::World world = must(world::load(apps::worlds_folder(), "parcel_cell"));
  const world::Manifest manifest = must(world::draw_manifest(world, parcels, seed));
  const Rehearsal rehearsal = rehearse(world, manifest, seed);

  const auto simulation = must(sim::Simulation::create(world, manifest, seed));
  sim::BareStep bare(*simulation);
  Cost ours, theirs;
  const Stretch told(rehearsal.told);
  std::size_t first = 0;
  for (; first + kStretch <= told.size(); first += kStretch) {
    const Stretch stretch = told.subspan(first, kStretch);
    bare.copy();
    // Who goes second finds warmer caches, so they take turns.
    const bool ours_first = first / kStretch % 2 == 0;
    if (ours_first) ours.us.push_back(measure(*simulation, stretch, first));
    theirs.us.push_back(measure(bare, stretch, first));
    if (!ours_first) ours.us.push_back(measure(*simulation, stretch, first));
  }
  (void)measure(*simulation, told.subspan(first), first);
  if (simulation->state_digest() != rehearsal.state_digest) {
    fmt::print(stderr, "simulation_step: the repeated run ended elsewhere than the rehearsed one\n");
    return 1;
  }
  const double steps = to_s(runner::kControlPeriod) * kStretch / world.physics_step_s;
  fmt::print("{} parcels, {:.0f} s simulated, {} stretches of {:.0f} steps\n", parcels,
             to_s(runner::kControlPeriod) * static_cast<double>(told.size()), ours.us.size(), steps);
  fmt::print("simulation {:.1f} us a step, bare mj_step {:.1f} us a step (medians)\n", ours.median() / steps,
             theirs.median() / steps);
  fmt::print("ratio of medians {:.3f}, of sums {:.3f}   (bound {:.1f})\n", ours.median() / theirs.median(),
             ours.sum() / theirs.sum(), kBound);
}
