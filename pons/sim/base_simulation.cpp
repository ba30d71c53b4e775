#include "pons/sim/base_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "pons/sim/base_compose.hpp"
#include "pons/sim/bus.hpp"
#include "pons/sim/lidar.hpp"
#include "pons/sim/renderer.hpp"
#include "pons/sim/truth.hpp"

namespace pons::sim {
namespace {

constexpr double kBrakeStiffness = 100, kBrakeDamping = 6;  // N·m/rad, N·m·s/rad: soft enough for a wheel off the floor
constexpr double kBrake = 1.5;                              // holding torque of a brake, in drive torques
constexpr double kBrakeHolds_rad_s = 0.02;
constexpr Duration kTold = std::chrono::milliseconds(10);  // between two places of the truth

}  // namespace

struct BaseSimulation::Impl final : body::Body {
  Impl(const world::World& the_world, ComposedBase the_composed, std::uint64_t seed)
      : world(the_world),
        composed(std::move(the_composed)),
        data(mj_makeData(composed.model.get())),
        bus(from_s(world.robot.drive_delay_s)),
        step_length(from_s(world.physics_step_s)) {
    set_points.torque_nm = AxisVector::Zero(2);
    measured.position = measured.speed = AxisVector::Zero(2);
    mj_forward(composed.model.get(), data.get());
    for (const world::CameraSpec& spec : world.cameras) {
      lidars.push_back(std::make_unique<SimLidar>(spec, composed.model.get(), data.get(), composed.base_body, seed));
      camera_list.push_back(lidars.back().get());
    }
  }

  void read(body::Sensors& sensors) PONS_NONBLOCKING override {
    sensors = measured;
    sensors.position += to_s(now - stepped) * sensors.speed;
    sensors.stamp = now;
    sensors.stop_input = stop_pressed;
    sensors.watchdog_tripped = watchdog_tripped;
  }

  void write(const body::SetPoints& told) PONS_NONBLOCKING override {
    if (bus.delay() > Duration{0})
      bus.send(told, now);
    else
      hear(told, now);
  }

  [[nodiscard]] Duration watchdog() const override { return from_s(world.robot.watchdog_s); }

  void hear(const body::SetPoints& told, Time at) PONS_NONBLOCKING {
    set_points = told;
    heard = at;
    if (!told.power) watchdog_tripped = false;
    if (watchdog_tripped) set_points.power = false;
  }

  // One physics step.
  void step() {
    for (const Bus::Told* told = bus.next(stepped + step_length); told != nullptr;
         bus.drop_oldest(), told = bus.next(stepped + step_length))
      hear(told->set_points, told->acts);
    if (set_points.power && stepped + step_length - heard > watchdog()) {
      watchdog_tripped = true;
      set_points.power = false;
    }
    drive();
    mj_step(composed.model.get(), data.get());
    stepped += step_length;
    for (std::size_t i = 0; i < 2; ++i) {
      measured.position[static_cast<Eigen::Index>(i)] = data->qpos[composed.wheel_qpos[i]];
      measured.speed[static_cast<Eigen::Index>(i)] = data->qvel[composed.wheel_dof[i]];
    }
    account();
  }

  void drive() {
    const double fastest =
        std::max(std::abs(data->qvel[composed.wheel_dof[0]]), std::abs(data->qvel[composed.wheel_dof[1]]));
    if (set_points.power) {
      held.resize(0);
    } else if (held.size() == 0 && fastest < kBrakeHolds_rad_s) {
      held = measured.position;
    }
    for (std::size_t i = 0; i < 2; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      data->ctrl[composed.actuator[i]] = set_points.power ? set_points.torque_nm[axis] : 0;
      double brake_nm = 0;
      if (!set_points.power) {
        const double away = held.size() == 0 ? 0 : held[axis] - data->qpos[composed.wheel_qpos[i]];
        const double most = kBrake * world.robot.limits.torque_nm[axis];
        brake_nm = std::clamp(kBrakeStiffness * away - kBrakeDamping * data->qvel[composed.wheel_dof[i]], -most, most);
      }
      data->qfrc_applied[composed.wheel_dof[i]] = brake_nm;
    }
  }

  [[nodiscard]] Pose2 place() const {
    const Pose pose = from_mujoco(data->qpos + composed.free_qpos, data->qpos + composed.free_qpos + 3);
    const auto x_axis = pose.linear().col(0);
    return {pose.translation().x(), pose.translation().y(), std::atan2(x_axis.y(), x_axis.x())};
  }

  // What it touches: anything but the floor is a collision, once for as long as it lasts.
  void account() {
    const double speed = std::hypot(data->qvel[composed.free_dof], data->qvel[composed.free_dof + 1]);
    truth.fastest_m_s = std::max(truth.fastest_m_s, speed);
    truth.driven_m += speed * world.physics_step_s;
    const mjModel* model = composed.model.get();
    int touched = -1;
    for (int i = 0; i < data->ncon; ++i) {
      const mjContact& contact = data->contact[i];
      const bool first = model->geom_group[contact.geom[0]] == kBaseGroup;
      const int other = contact.geom[first ? 1 : 0];
      if (other != composed.floor_geom && contact.dist < 0) touched = other;
    }
    if (touched >= 0 && !touching) {
      ++truth.collisions;
      const char* name = mj_id2name(model, mjOBJ_GEOM, touched);
      truth.touched = name == nullptr ? "something" : name;
    }
    touching = touched >= 0;
    if (stepped.ns() % kTold.count() == 0) truth.way.add({stepped, place()});
  }

  const world::World& world;
  ComposedBase composed;
  DataPtr data;
  std::vector<std::unique_ptr<SimLidar>> lidars;
  std::vector<body::Camera*> camera_list;
  Bus bus;
  body::SetPoints set_points;
  body::Sensors measured;
  Duration step_length;
  Time stepped, now, heard;
  bool stop_pressed = false, watchdog_tripped = false, touching = false;
  AxisVector held;  // where the brakes hold the wheels; empty while they turn
  BaseTruth truth;
  std::string failure;
};

BaseSimulation::BaseSimulation(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
BaseSimulation::~BaseSimulation() = default;

Expected<std::unique_ptr<BaseSimulation>> BaseSimulation::create(const world::World& world, std::uint64_t seed) {
  auto composed = compose_base(world);
  if (!composed) return std::unexpected(composed.error());
  return std::unique_ptr<BaseSimulation>(new BaseSimulation(std::make_unique<Impl>(world, std::move(*composed), seed)));
}

void BaseSimulation::advance_to(Time time) {
  try {
    while (impl_->stepped + impl_->step_length <= time && impl_->failure.empty()) impl_->step();
  } catch (const std::exception& error) {
    impl_->failure = error.what();
  }
  if (time > impl_->now) impl_->now = time;
}

body::Body& BaseSimulation::body() { return *impl_; }
const std::vector<body::Camera*>& BaseSimulation::cameras() const { return impl_->camera_list; }
void BaseSimulation::press_stop(bool pressed) { impl_->stop_pressed = pressed; }
std::uint64_t BaseSimulation::state_digest() const { return digest_of(impl_->composed.model.get(), impl_->data.get()); }

Expected<void> BaseSimulation::health() const {
  const std::string where = fmt::format("simulation at {:.3f} s", impl_->stepped.s());
  constexpr const char* kMend = "report the seed and the world";
  if (!impl_->failure.empty()) return fail("the simulation gave up: " + impl_->failure, where, kMend);
  for (int i = 0; i < mjNWARNING; ++i) {
    const mjWarningStat& warning = impl_->data->warning[i];
    if (warning.number == 0) continue;
    return fail(fmt::format("MuJoCo warned {} times: {}", warning.number,
                            mju_warningText(i, static_cast<size_t>(warning.lastinfo))),
                where, kMend);
  }
  for (int i = 0; i < impl_->composed.model->nq; ++i) {
    if (!std::isfinite(impl_->data->qpos[i])) return fail(fmt::format("position {} is not finite", i), where, kMend);
  }
  return {};
}

Expected<std::vector<std::uint8_t>> BaseSimulation::picture(int width, int height) const {
  return draw_picture(impl_->composed.model.get(), impl_->data.get(), impl_->composed.picture_camera, LabelStore{},
                      width, height);
}

const BaseTruth& truth_of(const BaseSimulation& simulation) { return simulation.impl_->truth; }

}  // namespace pons::sim
