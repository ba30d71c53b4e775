#include "pons/cerebellum/test_bench.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>

#include "pons/motion/online.hpp"

namespace pons::cerebellum {
namespace {

world::Robot make_robot() {
  constexpr double kPi = std::numbers::pi;
  world::Robot robot;
  robot.name = "ur5e";
  robot.urdf = "worlds/robots/ur5e/ur5e.urdf";
  robot.flange_link = "tool0";
  robot.world_from_base.translation() = Vector3(0, -0.30, 1.70);
  robot.world_from_base.linear() = Eigen::AngleAxisd(kPi, Vector3::UnitX()).toRotationMatrix();
  robot.home = AxisVector(6);
  robot.home << kPi / 2, 0.4, -1.97, kPi / 2 + 1.57, -kPi / 2, 0;
  robot.limits.position_min = AxisVector::Constant(6, -2 * kPi);
  robot.limits.position_max = AxisVector::Constant(6, 2 * kPi);
  robot.limits.speed_rad_s = AxisVector::Constant(6, 3.14);
  robot.limits.acceleration_rad_s2 = AxisVector::Constant(6, 20);
  robot.limits.jerk_rad_s3 = AxisVector::Constant(6, 400);
  robot.limits.torque_nm = AxisVector(6);
  robot.limits.torque_nm << 150, 150, 150, 28, 28, 28;
  robot.rotor_inertia_kg_m2 = AxisVector::Constant(6, 0.01);
  robot.tool.mass_kg = 0.9;
  robot.tool.com_m = Vector3(0, 0, 0.06);
  robot.tool.cups_m.resize(4, Vector3::Zero());
  robot.tool.flange_from_tip.translation() = Vector3(0, 0, 0.16);
  robot.tool.sealed_kpa = 35;
  robot.tool.cups_to_lift = 3;
  return robot;
}

// The URDF with every mass and inertia scaled, written where tests may write.
std::filesystem::path scaled_urdf(const std::filesystem::path& urdf, double by) {
  std::ifstream in(urdf);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  for (const std::string key : {"mass value=\"", "ixx=\"", "ixy=\"", "ixz=\"", "iyy=\"", "iyz=\"", "izz=\""}) {
    for (auto at = text.find(key); at != std::string::npos; at = text.find(key, at)) {
      at += key.size();
      const auto length = text.find('"', at) - at;
      text.replace(at, length, std::to_string(std::stod(text.substr(at, length)) * by));
    }
  }
  // Tests run side by side: nobody may read it half-written.
  const auto path = std::filesystem::path(testing::TempDir()) / ("scaled_" + std::to_string(by) + ".urdf");
  const auto mine = path.string() + "." + std::to_string(getpid());
  std::ofstream(mine) << text;
  std::filesystem::rename(mine, path);
  return path;
}

model::RobotModel controller_model(const PlantSettings& plant) {
  world::Robot robot = bench_robot();
  robot.drive_delay_s = to_s(plant.told_delay);
  if (plant.axis_2_max_rad) robot.limits.position_max[1] = *plant.axis_2_max_rad;
  return model::RobotModel::load(robot).value();
}

}  // namespace

const world::Robot& bench_robot() {
  static const world::Robot robot = make_robot();
  return robot;
}

model::RobotModel bench_model(double masses) {
  world::Robot robot = bench_robot();
  if (masses != 1) {
    robot.urdf = scaled_urdf(robot.urdf, masses);
    robot.tool.mass_kg *= masses;
  }
  return model::RobotModel::load(robot).value();
}

Plant::Plant(const PlantSettings& settings, const AxisVector& position)
    : extra_torque_nm(AxisVector::Zero(position.size())),
      settings_(settings),
      model_(bench_model(settings.masses)),
      told_(delay_ticks(to_s(settings.drive_delay), std::chrono::milliseconds(1)), {}),
      position_(position),
      speed_(AxisVector::Zero(position.size())) {
  sensors.position = position_;
  sensors.speed = speed_;
}

void Plant::advance_to(Time time) {
  AxisVector acceleration;
  const double dt = to_s(settings_.step);
  told_.push(set_points);
  const body::SetPoints& acts = told_.out();
  while (time_ + settings_.step <= time) {
    time_ += settings_.step;
    if (acts.power && !blocked) {
      model_.forward_dynamics(position_, speed_, acts.torque_nm + extra_torque_nm, settings_.payload, acceleration);
      speed_ += dt * acceleration;
      position_ += dt * speed_;
    } else {
      speed_.setZero();
    }
    if (silent) continue;
    sensors.stamp = time_;
    sensors.position = position_;
    sensors.speed = speed_;
  }
}

void Plant::place(const AxisVector& position) {
  position_ = sensors.position = position;
  speed_.setZero();
}

Bench::Bench(const PlantSettings& plant_settings, const Settings& settings)
    : cerebellum(controller_model(plant_settings), settings, Time{}), plant(plant_settings, bench_robot().home) {}

void Bench::tick() {
  now += std::chrono::milliseconds(1);
  plant.advance_to(now);
  if (!mute && now.ns() % 10'000'000 == 0) send(plain_command(link::CommandKind::kHeartbeat));
  body::Sensors seen = plant.sensors;
  if (spoil) spoil(seen);
  cerebellum.step(now, seen, end, plant.set_points);
  if (operational()) worst_error_rad = std::max(worst_error_rad, error_rad());
}

void Bench::run(Duration duration) {
  for (const Time end_of_run = now + duration; now < end_of_run;) tick();
}

double Bench::error_rad() const {
  const double age = to_s(now - plant.sensors.stamp);
  const AxisVector position = plant.sensors.position + age * plant.sensors.speed;
  return (state().commanded.position - position).cwiseAbs().maxCoeff();
}

void Bench::send(link::Command command) {
  command.sequence = ++sequence_;
  command.epoch = state().epoch;
  ASSERT_TRUE(bridge.send(command));
}

void Bench::send_old(link::Command command) {
  command.sequence = ++sequence_;
  command.epoch = state().epoch - 1;
  ASSERT_TRUE(bridge.send(command));
}

void Bench::move(const AxisVector& to) {
  const AxisState rest{state().commanded.position, AxisVector::Zero(6), AxisVector::Zero(6)};
  move(point_to_point(rest, now + std::chrono::milliseconds(20), to, bench_robot().limits));
}

void Bench::move(const std::vector<Segment>& motion) {
  bool first = true;
  for (const Segment& segment : motion) {
    send(motion_command(segment, first));
    first = false;
  }
}

void Bench::arm() {
  run(std::chrono::milliseconds(30));
  send(plain_command(link::CommandKind::kArm));
  tick();
  ASSERT_TRUE(operational());
}

void get_moving(Bench& bench) {
  bench.arm();
  bench.move(bench_robot().home.array() + 0.8);
  bench.run(std::chrono::milliseconds(300));
  ASSERT_TRUE(bench.operational());
  ASSERT_GT(bench.state().commanded.speed.cwiseAbs().maxCoeff(), 0.5);
}

std::vector<Segment> point_to_point(const AxisState& start, Time at, const AxisVector& to, const AxisLimits& limits) {
  const auto axes = static_cast<std::size_t>(to.size());
  std::vector<motion::AxisProfile> profiles(axes);
  std::vector<motion::AxisTask> tasks;
  for (Eigen::Index i = 0; i < to.size(); ++i) {
    tasks.push_back(
        {{start.position[i], start.speed[i], start.acceleration[i]},
         to[i],
         0,
         motion::AxisBounds::symmetric(limits.speed_rad_s[i], limits.acceleration_rad_s2[i], limits.jerk_rad_s3[i])});
  }
  if (!motion::plan_positions(tasks, {}, profiles)) return {};
  std::vector<double> knots{0};
  for (Eigen::Index i = 0; i < to.size(); ++i) {
    const auto& profile = profiles[static_cast<std::size_t>(i)];
    for (std::size_t k = 1; k <= profile.phases(); ++k) knots.push_back(profile.begin_s(k));
  }
  std::sort(knots.begin(), knots.end());
  std::vector<Segment> segments;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    Segment segment;
    segment.start = at + from_s(knots[k]);
    segment.duration = at + from_s(knots[k + 1]) - segment.start;
    if (segment.duration <= std::chrono::nanoseconds(10)) continue;
    if (!segments.empty()) segments.back().duration = segment.start - segments.back().start;
    for (std::size_t i = 0; i < axes; ++i) {
      const auto p = profiles[i].at(knots[k]);
      segment.coefficients[i] = {
          p.position, p.speed, p.acceleration / 2, profiles[i].jerk_at((knots[k] + knots[k + 1]) / 2) / 6, 0, 0};
    }
    segments.push_back(segment);
  }
  return segments;
}

}  // namespace pons::cerebellum
