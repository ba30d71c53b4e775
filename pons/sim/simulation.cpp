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
constexpr double kBrakeHolds_rad_s = 0.02;

std::vector<Arrival> arriving(const world::World& world, const world::Manifest& manifest, std::uint64_t seed,
                              Faults& faults) {
  std::vector<Arrival> arrivals = plan_arrivals(world, manifest, seed);
  faults.add_labels(world, manifest, arrivals);
  return arrivals;
}

}  // namespace

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
      curtains(world),
      body(this),
      noise(Random(seed).fork(kNoiseStream)),
      bus(from_s(world.robot.drive_delay_s)),
      step_length(from_s(world.physics_step_s)),
      brake_acceleration_(static_cast<std::size_t>(composed.model->nv)),
      brake_torque_(brake_acceleration_) {
  set_points.torque_nm = AxisVector::Zero(world.robot.home.size());
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
  for (; const Bus::Told* told = bus.next(stepped + step_length); bus.drop_oldest()) hear(told->set_points, told->acts);
  watch_loop();
  drive_belt();
  const Suction suction = faults.suction(set_points.vacuum_on, gripper, ledger, stepped);
  gripper.update(composed, data.get(), set_points.vacuum_on, suction, world.physics_step_s);
  faults.cling(composed, data.get(), gripper, ledger);
  drive();
  push();
  mj_step(model, data.get());
  stepped += step_length;
  gripper.measure(composed, data.get());
  measure();
  ledger.update(composed, data.get(), gripper, set_points.vacuum_on, set_points.torque_nm, stepped);
}

void Cell::drive_belt() {
  set_points.belt_runs && !faults.belt_jams(stepped) ? belt.let_run() : belt.stop();
  if (belt.starts()) {
    for (int i = 0; i < kSlots; ++i) {
      if (ledger.on_belt(i)) wake(data.get(), composed.slots[static_cast<std::size_t>(i)]);
    }
  }
  belt.step(composed.model.get(), composed.belt_geom, stepped, world.physics_step_s);
}

void Cell::hear(const body::SetPoints& told, Time at) PONS_NONBLOCKING {
  set_points = told;
  heard = at;
  if (!told.power) watchdog_tripped = false;
  if (watchdog_tripped) set_points.power = set_points.belt_runs = false;
}

void Cell::watch_loop() {
  if (!set_points.power || stepped + step_length - heard <= body.watchdog()) return;
  watchdog_tripped = true;
  set_points.power = set_points.belt_runs = false;
}

void Cell::drive() {
  for (std::size_t i = 0; i < composed.arm_actuator.size(); ++i) {
    const double torque = set_points.power ? set_points.torque_nm[static_cast<Eigen::Index>(i)] : 0;
    data->ctrl[composed.arm_actuator[i]] = torque;
  }
  if (set_points.power) {
    held.resize(0);
    for (const int dof : composed.arm_dof) data->qfrc_applied[dof] = 0;
  } else {
    brake();
  }
}

void Cell::push() {
  const int body_id = composed.tool_body;
  const double* turn = data->site_xmat + 9 * composed.wrist_site;
  const Eigen::Map<const Vector3> flange(data->site_xpos + 3 * composed.wrist_site), com(data->xipos + 3 * body_id);
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> world_from_flange(turn);
  const Vector3 tip = flange + world_from_flange * world.robot.tool.flange_from_tip.translation();
  const Vector3 moment = Vector3(tip - com).cross(push_n);
  double* applied = data->xfrc_applied + 6 * body_id;
  std::copy_n(push_n.data(), 3, applied);
  std::copy_n(moment.data(), 3, applied + 3);
}

// Brakes slow the joints at once and then hold them where they stand, with at most kBrake times the drives' torque. Dry
// friction as a constraint creeps under the arm's weight, or makes the solver stumble when it is made stiff.
void Cell::brake() {
  const mjModel* model = composed.model.get();
  const auto axes = static_cast<Eigen::Index>(composed.arm_dof.size());
  double fastest = 0;
  for (const int dof : composed.arm_dof) fastest = std::max(fastest, std::abs(data->qvel[dof]));
  if (held.size() == 0 && fastest < kBrakeHolds_rad_s) {
    held.resize(axes);
    for (Eigen::Index i = 0; i < axes; ++i) held[i] = data->qpos[composed.arm_qpos[static_cast<std::size_t>(i)]];
  }
  std::fill(brake_acceleration_.begin(), brake_acceleration_.end(), 0.0);
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = composed.arm_dof[static_cast<std::size_t>(i)];
    const double away = held.size() == 0 ? 0 : held[i] - data->qpos[composed.arm_qpos[static_cast<std::size_t>(i)]];
    brake_acceleration_[static_cast<std::size_t>(dof)] = kBrakeStiffness * away - kBrakeDamping * data->qvel[dof];
  }
  mj_mulM(model, data.get(), brake_torque_.data(), brake_acceleration_.data());
  for (Eigen::Index i = 0; i < axes; ++i) {
    const int dof = composed.arm_dof[static_cast<std::size_t>(i)];
    const double most = kBrake * world.robot.limits.torque_nm[i];
    data->qfrc_applied[dof] =
        std::clamp(brake_torque_[static_cast<std::size_t>(dof)] + data->qfrc_bias[dof], -most, most);
  }
}

void Cell::measure() {
  const auto axes = static_cast<Eigen::Index>(composed.arm_qpos.size());
  measured.position.resize(axes);
  measured.speed.resize(axes);
  for (Eigen::Index i = 0; i < axes; ++i) {
    measured.position[i] = data->qpos[composed.arm_qpos[static_cast<std::size_t>(i)]];
    measured.speed[i] = data->qvel[composed.arm_dof[static_cast<std::size_t>(i)]];
  }
  const std::array<double, 6> wrist = gripper.wrist(composed, data.get());
  for (std::size_t i = 0; i < 3 && world.robot.wrist_sensor; ++i) {
    measured.wrist_force_n[i] = wrist[i] + kForceNoise_n * noise.normal();
    measured.wrist_torque_nm[i] = wrist[i + 3] + kTorqueNoise_nm * noise.normal();
  }
  for (std::size_t i = 0; i < composed.cups.size(); ++i) {
    measured.cup_vacuum_kpa[i] = gripper.pressure_kpa(i) + kVacuumNoise_kpa * noise.normal();
  }
  measured.belt_travel_m = belt.travel_m();
  measured.belt_speed_m_s = belt.speed_m_s();
  measured.photo_eye_blocked = feeder.photo_eye(composed, data.get(), ledger);
  curtains.update(composed, data.get(), ledger);
  measured.fallen_into = curtains.counts();
}

void SimBody::read(body::Sensors& sensors) {
  sensors = cell_->measured;
  const double since_s = to_s(cell_->now - cell_->stepped);
  if (since_s > 0) {
    sensors.position += since_s * sensors.speed;
    sensors.belt_travel_m += since_s * sensors.belt_speed_m_s;
  }
  sensors.stamp = cell_->now;
  sensors.stop_input = cell_->stop_pressed;
  sensors.watchdog_tripped = cell_->watchdog_tripped;
  sensors.zones_occupied = 0;
  for (const Visit& visit : cell_->visits) {
    if (cell_->now >= visit.from && cell_->now < visit.from + visit.stays) sensors.zones_occupied |= 1U << visit.zone;
  }
}

void SimBody::write(const body::SetPoints& set_points) {
  if (cell_->bus.delay() > Duration{0})
    cell_->bus.send(set_points, cell_->now);
  else
    cell_->hear(set_points, cell_->now);
}

Duration SimBody::watchdog() const { return from_s(cell_->world.robot.watchdog_s); }

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
  simulation->set_arm(world.robot.home);
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

body::Body& Simulation::body() { return cell_->body; }
const std::vector<body::Camera*>& Simulation::cameras() const { return cell_->camera_list; }
void Simulation::run_belt() {
  cell_->body.write({.torque_nm = AxisVector::Zero(cell_->world.robot.home.size()), .belt_runs = true});
}
void Simulation::press_stop(bool pressed) { cell_->stop_pressed = pressed; }

void Simulation::push_tip(const Vector3& force_n) { cell_->push_n = force_n; }

void Simulation::expect_visits(std::vector<Visit> visits) { cell_->visits = std::move(visits); }

void Simulation::set_arm(const AxisVector& position) {
  Cell& cell = *cell_;
  const auto axes = static_cast<Eigen::Index>(cell.composed.arm_qpos.size());
  for (Eigen::Index i = 0; i < axes; ++i) {
    cell.data->qpos[cell.composed.arm_qpos[static_cast<std::size_t>(i)]] = position[i];
    cell.data->qvel[cell.composed.arm_dof[static_cast<std::size_t>(i)]] = 0;
  }
  mj_forward(cell.composed.model.get(), cell.data.get());
  cell.held.resize(0);
  cell.measured.position = position;
  cell.measured.speed = AxisVector::Zero(axes);
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
