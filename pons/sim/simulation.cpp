#include "pons/sim/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "pons/sim/cell.hpp"
#include "pons/sim/parcels.hpp"

namespace pons::sim {
namespace {

constexpr std::uint64_t kNoiseStream = 0x6e6f6973;
constexpr double kForceNoise_n = 0.15, kTorqueNoise_nm = 0.01, kVacuumNoise_kpa = 0.3;
constexpr double kBrake = 1.5;                                 // holding torque of a brake, in drive torques
constexpr double kBrakeStiffness = 3600, kBrakeDamping = 120;  // 1/s², 1/s: 60 rad/s, critically damped

std::vector<Arrival> arriving(const world::World& world, const world::Manifest& manifest, std::uint64_t seed,
                              Faults& faults) {
  std::vector<Arrival> arrivals = plan_arrivals(world, manifest, seed);
  faults.add_labels(world, manifest, arrivals);
  return arrivals;
}

}  // namespace

SimArm::SimArm(Cell& the_cell, std::size_t index, std::uint64_t seed)
    : cell(the_cell),
      station(cell.world.arms()[index]),
      composed(cell.composed.arms[index]),
      gripper(composed),
      curtains(station),
      noise(Random(seed).fork(kNoiseStream + index)),
      bus(from_s(station.robot.drive_delay_s)),
      brake_acceleration_(static_cast<std::size_t>(cell.composed.model->nv)),
      brake_torque_(brake_acceleration_) {
  set_points.torque_nm = AxisVector::Zero(station.robot.home.size());
}

Cell::Cell(const world::World& the_world, const world::Manifest& manifest, Composed the_composed, std::uint64_t seed,
           const world::FaultPlan& plan)
    : world(the_world),
      composed(std::move(the_composed)),
      data(mj_makeData(composed.model.get())),
      faults(plan, seed),
      arrivals(arriving(world, manifest, seed, faults)),
      belt(world.belt, seed),
      ledger(world, manifest, arrivals),
      feeder(world, manifest, arrivals),
      step_length(from_s(world.physics_step_s)) {
  for (std::size_t i = 0; i < composed.arms.size(); ++i) arms.push_back(std::make_unique<SimArm>(*this, i, seed));
  for (int i = 0; i < kSlots; ++i) {
    const Slot& slot = composed.slots[static_cast<std::size_t>(i)];
    park(composed.model.get(), data.get(), slot, i);
    labels.entries.push_back({slot.texture, 0, {}});
  }
  for (const Slot& slot : composed.slots) {
    if (slot.second_texture >= 0) labels.entries.push_back({slot.second_texture, 0, {}});
  }
}

void Cell::step() {
  mjModel* model = composed.model.get();
  feeder.step(composed, model, data.get(), ledger, labels, belt, stepped);
  for (const auto& one : arms) one->listen();
  drive_belt();
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const std::uint32_t vacuum_on = arms[i]->set_points.vacuum_on;
    const Suction suction = faults.suction(i, vacuum_on, arms[i]->gripper, ledger, stepped);
    arms[i]->gripper.update(composed, data.get(), vacuum_on, suction, world.physics_step_s);
  }
  faults.cling(composed, data.get(), arm_steps(), ledger);
  for (const auto& one : arms) {
    one->drive();
    one->push();
  }
  mj_step(model, data.get());
  stepped += step_length;
  for (const auto& one : arms) {
    one->gripper.measure(data.get());
    one->measure();
  }
  ledger.update(composed, data.get(), arm_steps(), stepped);
}

std::vector<ArmStep> Cell::arm_steps() const {
  std::vector<ArmStep> steps;
  for (const auto& one : arms)
    steps.push_back({one->composed, one->gripper, one->set_points.vacuum_on, one->set_points.torque_nm});
  return steps;
}

// As an interlock has it: some arm lets it run, and none that has power wants it to stand. One without power is braked:
// that it stands clear, see those who let the belt run.
bool Cell::belt_may_run() const {
  const auto lets = [](const auto& one) { return one->set_points.belt_runs; };
  return std::ranges::any_of(arms, lets) &&
         std::ranges::all_of(arms, [&](const auto& one) { return lets(one) || !one->set_points.power; });
}

void Cell::drive_belt() {
  belt_may_run() && !faults.belt_jams(stepped) ? belt.let_run() : belt.stop();
  belt.step(composed.model.get(), composed.belt_geom, stepped, world.physics_step_s);
  if (belt.speed_m_s() == 0) return;
  for (int i = 0; i < kSlots; ++i) {
    const Slot& slot = composed.slots[static_cast<std::size_t>(i)];
    if (ledger.parcel_in(i) < 0 || !sleeps(*composed.model, *data, slot)) continue;
    if (is_over(world.belt, Vector3::Map(data->qpos + slot.qpos))) wake(data.get(), slot);
  }
}

void SimArm::hear(const body::SetPoints& told, Time at) PONS_NONBLOCKING {
  set_points = told;
  heard = at;
  if (!told.power) watchdog_tripped = false;
  if (watchdog_tripped) set_points.power = set_points.belt_runs = false;
}

void SimArm::listen() {
  const Time until = cell.stepped + cell.step_length;
  for (const Bus::Told* told = bus.next(until); told != nullptr; bus.drop_oldest(), told = bus.next(until))
    hear(told->set_points, told->acts);
  if (!set_points.power || until - heard <= watchdog()) return;
  watchdog_tripped = true;
  set_points.power = set_points.belt_runs = false;
}

void SimArm::drive() {
  mjData* data = cell.data.get();
  for (std::size_t i = 0; i < composed.actuator.size(); ++i) {
    const double torque = set_points.power ? set_points.torque_nm[static_cast<Eigen::Index>(i)] : 0;
    data->ctrl[composed.actuator[i]] = torque;
  }
  if (set_points.power) {
    held.resize(0);
    for (const int dof : composed.dof) data->qfrc_applied[dof] = 0;
  } else {
    brake();
  }
}

void SimArm::push() {
  mjData* data = cell.data.get();
  const int body_id = composed.tool_body;
  const double* turn = data->site_xmat + 9 * composed.wrist_site;
  const Eigen::Map<const Vector3> flange(data->site_xpos + 3 * composed.wrist_site), com(data->xipos + 3 * body_id);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> world_from_flange(turn);
  const Vector3 tip = flange + world_from_flange * station.robot.tool.flange_from_tip.translation();
  const Vector3 moment = Vector3(tip - com).cross(push_n);
  double* applied = data->xfrc_applied + 6 * body_id;
  std::copy_n(push_n.data(), 3, applied);
  std::copy_n(moment.data(), 3, applied + 3);
}

// Brakes hold the joints where they are, with at most kBrake times the drives' torque. What they cannot stop at once
// slips, every joint by the same share: brakes only take energy, and a wrist that was braked as if the other joints
// stood already was thrown by it. Held by a spring, so that what the model does not know of, a load, moves the arm a
// little and not for ever. Dry friction as a constraint creeps under the arm's weight, or makes the solver stumble when
// it is made stiff.
void SimArm::brake() {
  const mjModel* model = cell.composed.model.get();
  mjData* data = cell.data.get();
  const auto axes = static_cast<Eigen::Index>(composed.dof.size());
  const auto stay_here = [&] {
    held.resize(axes);
    for (Eigen::Index i = 0; i < axes; ++i) held[i] = data->qpos[composed.qpos[static_cast<std::size_t>(i)]];
  };
  if (held.size() == 0) stay_here();
  std::fill(brake_acceleration_.begin(), brake_acceleration_.end(), 0.0);
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = composed.dof[static_cast<std::size_t>(i)];
    const double away = held[i] - data->qpos[composed.qpos[static_cast<std::size_t>(i)]];
    brake_acceleration_[static_cast<std::size_t>(dof)] = kBrakeStiffness * away - kBrakeDamping * data->qvel[dof];
  }
  mj_mulM(model, data, brake_torque_.data(), brake_acceleration_.data());
  const AxisVector most = kBrake * station.robot.limits.torque_nm;
  double share = 1;
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = composed.dof[static_cast<std::size_t>(i)];
    const double asked = brake_torque_[static_cast<std::size_t>(dof)];
    const double left = std::max(0.0, most[i] - std::copysign(data->qfrc_bias[dof], data->qfrc_bias[dof] * asked));
    if (std::abs(asked) > left) share = std::min(share, left / std::abs(asked));
  }
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = composed.dof[static_cast<std::size_t>(i)];
    const double torque = share * brake_torque_[static_cast<std::size_t>(dof)] + data->qfrc_bias[dof];
    data->qfrc_applied[dof] = std::clamp(torque, -most[i], most[i]);
  }
  if (share < 1) stay_here();
}

void SimArm::measure() {
  const mjData* data = cell.data.get();
  const auto axes = static_cast<Eigen::Index>(composed.qpos.size());
  measured.position.resize(axes);
  measured.speed.resize(axes);
  for (Eigen::Index i = 0; i < axes; ++i) {
    measured.position[i] = data->qpos[composed.qpos[static_cast<std::size_t>(i)]];
    measured.speed[i] = data->qvel[composed.dof[static_cast<std::size_t>(i)]];
  }
  const std::array<double, 6> wrist = gripper.wrist(data);
  for (std::size_t i = 0; i < 3 && station.robot.wrist_sensor; ++i) {
    measured.wrist_force_n[i] = wrist[i] + kForceNoise_n * noise.normal();
    measured.wrist_torque_nm[i] = wrist[i + 3] + kTorqueNoise_nm * noise.normal();
  }
  for (std::size_t i = 0; i < composed.cups.size(); ++i) {
    measured.cup_vacuum_kpa[i] = gripper.pressure_kpa(i) + kVacuumNoise_kpa * noise.normal();
  }
  measured.belt_travel_m = cell.belt.travel_m();
  measured.belt_speed_m_s = cell.belt.speed_m_s();
  measured.photo_eye_blocked = cell.feeder.photo_eye(cell.composed, data, cell.ledger);
  curtains.update(cell.composed, data, cell.ledger);
  measured.fallen_into = curtains.counts();
}

void SimArm::read(body::Sensors& sensors) {
  sensors = measured;
  const double since_s = to_s(cell.now - cell.stepped);
  if (since_s > 0) {
    sensors.position += since_s * sensors.speed;
    sensors.belt_travel_m += since_s * sensors.belt_speed_m_s;
  }
  sensors.stamp = cell.now;
  sensors.stop_input = cell.stop_pressed;
  sensors.watchdog_tripped = watchdog_tripped;
  sensors.zones_occupied = 0;
  for (const Visit& visit : cell.visits) {
    if (cell.now >= visit.from && cell.now < visit.from + visit.stays) sensors.zones_occupied |= 1U << visit.zone;
  }
}

void SimArm::write(const body::SetPoints& told) {
  if (bus.delay() > Duration{0})
    bus.send(told, cell.now);
  else
    hear(told, cell.now);
}

Duration SimArm::watchdog() const { return from_s(station.robot.watchdog_s); }

Simulation::Simulation(std::unique_ptr<Cell> cell) : cell_(std::move(cell)) {}
Simulation::~Simulation() = default;

Expected<std::unique_ptr<Simulation>> Simulation::create(const world::World& world, const world::Manifest& manifest,
                                                         std::uint64_t seed, const world::FaultPlan& faults) {
  auto composed = compose(world, faults);
  if (!composed) return std::unexpected(composed.error());
  auto cell = std::make_unique<Cell>(world, manifest, std::move(*composed), seed, faults);
  for (std::size_t i = 0; i < world.cameras.size(); ++i) {
    auto camera =
        SimCamera::create(world.cameras[i], cell->composed.model.get(), cell->data.get(), cell->composed.cameras[i],
                          &cell->labels, seed, world.cameras[i].watches == "belt" ? &cell->faults : nullptr);
    if (!camera) return std::unexpected(camera.error());
    cell->camera_list.push_back(camera->get());
    cell->cameras.push_back(std::move(*camera));
  }
  std::unique_ptr<Simulation> simulation(new Simulation(std::move(cell)));
  for (std::size_t i = 0; i < world.arms().size(); ++i) simulation->set_arm(world.arms()[i].robot.home, i);
  return simulation;
}

void Simulation::advance_to(Time time) {
  Cell& cell = *cell_;
  try {
    while (cell.stepped + cell.step_length <= time && cell.failure.empty()) cell.step();
  } catch (const std::exception& error) {
    cell.failure = error.what();
  }
  if (time > cell.now) cell.now = time;
}

body::Body& Simulation::body(std::size_t arm) { return cell_->arm(arm); }
const std::vector<body::Camera*>& Simulation::cameras() const { return cell_->camera_list; }
void Simulation::lend(const Both& both) {
  for (const auto& camera : cell_->cameras) camera->lend(both);
}
void Simulation::run_belt() {
  for (const auto& arm : cell_->arms)
    arm->write({.torque_nm = AxisVector::Zero(arm->station.robot.home.size()), .belt_runs = true});
}
void Simulation::press_stop(bool pressed) { cell_->stop_pressed = pressed; }

void Simulation::push_tip(const Vector3& force_n) { cell_->arm().push_n = force_n; }

void Simulation::expect_visits(std::vector<Visit> visits) { cell_->visits = std::move(visits); }

void Simulation::set_arm(const AxisVector& position, std::size_t index) {
  Cell& cell = *cell_;
  SimArm& arm = cell.arm(index);
  const auto axes = static_cast<Eigen::Index>(arm.composed.qpos.size());
  for (Eigen::Index i = 0; i < axes; ++i) {
    cell.data->qpos[arm.composed.qpos[static_cast<std::size_t>(i)]] = position[i];
    cell.data->qvel[arm.composed.dof[static_cast<std::size_t>(i)]] = 0;
  }
  mj_forward(cell.composed.model.get(), cell.data.get());
  arm.held.resize(0);
  arm.measured.position = position;
  arm.measured.speed = AxisVector::Zero(axes);
}

int Simulation::offered() const { return cell_->feeder.offered(); }

bool Simulation::finished() const {
  return static_cast<std::size_t>(offered()) == cell_->ledger.size() && cell_->ledger.in_transit() == 0;
}

world::FaultCounts Simulation::faults() const {
  world::FaultCounts counts = cell_->faults.counts();
  for (std::size_t i = 0; i < static_cast<std::size_t>(offered()); ++i)
    counts[world::Fault::kDoubleLabel] += cell_->arrivals[i].second_text.empty() ? 0 : 1;
  return counts;
}

std::uint64_t Simulation::state_digest() const { return digest_of(cell_->composed.model.get(), cell_->data.get()); }

Expected<void> Simulation::health() const {
  const Cell& cell = *cell_;
  const std::string where = fmt::format("simulation at {:.3f} s", cell.stepped.s());
  if (!cell.failure.empty())
    return fail("the simulation gave up: " + cell.failure, where, "report the seed and the world");
  for (int i = 0; i < mjNWARNING; ++i) {
    const mjWarningStat& warning = cell.data->warning[i];
    if (warning.number == 0) continue;
    return fail(fmt::format("MuJoCo warned {} times: {}", warning.number,
                            mju_warningText(i, static_cast<size_t>(warning.lastinfo))),
                where, "report the seed and the world");
  }
  for (int i = 0; i < cell.composed.model->nq; ++i) {
    if (!std::isfinite(cell.data->qpos[i])) {
      return fail(fmt::format("position {} is not finite", i), where, "report the seed and the world");
    }
  }
  return {};
}

Expected<std::vector<std::uint8_t>> Simulation::picture(int width, int height) const {
  const Cell& cell = *cell_;
  return draw_picture(cell.composed.model.get(), cell.data.get(), cell.composed.picture_camera, cell.labels, width,
                      height);
}

}  // namespace pons::sim
