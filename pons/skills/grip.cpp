#include "pons/skills/grip.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "pons/core/gravity.hpp"

namespace pons::skills {
namespace {

constexpr double kStep_s = 0.010;
constexpr double kFriction = 0.8;  // between a lip and cardboard

Vector3 turn_between(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to) {
  const Eigen::AngleAxisd turn(Eigen::Matrix3d(from.transpose() * to));
  return turn.angle() * turn.axis();
}

// Force and moment (about the tip) that the cups must exert on the load, tip frame.
struct Wrench {
  Vector3 force_n, moment_nm;
};

Wrench wrench(const std::array<Pose, 3>& poses, const Load& load, double mass_kg) {
  const Vector3 tip_from_com = load.offset_in_tip_m + Vector3(0, 0, 0.5 * load.size_m.z());
  const Vector3 acceleration =
      (poses[0] * tip_from_com - 2 * (poses[1] * tip_from_com) + poses[2] * tip_from_com) / (kStep_s * kStep_s);
  const Vector3 spin_up =
      (turn_between(poses[1].linear(), poses[2].linear()) - turn_between(poses[0].linear(), poses[1].linear())) /
      (kStep_s * kStep_s);
  const Vector3 square = load.size_m.cwiseProduct(load.size_m);
  const Eigen::Matrix3d tip_from_load = Eigen::AngleAxisd(load.yaw_in_tip_rad, Vector3::UnitZ()).toRotationMatrix();
  const Vector3 inertia =
      mass_kg / 12 * Vector3(square.y() + square.z(), square.x() + square.z(), square.x() + square.y());
  const Vector3 force = mass_kg * (poses[1].linear().transpose() * (acceleration + Vector3(0, 0, kGravity_m_s2)));
  return {force,
          tip_from_com.cross(force) + tip_from_load * inertia.asDiagonal() * (tip_from_load.transpose() * spin_up)};
}

double use(const world::Tool& tool, const Wrench& asked) {
  double xx = 0, yy = 0, farthest = 0;
  for (const Vector3& cup : tool.cups_m) {
    xx += cup.x() * cup.x();
    yy += cup.y() * cup.y();
    farthest = std::max(farthest, cup.head<2>().norm());
  }
  const auto cups = static_cast<double>(tool.cups_m.size());
  const double twist_n = std::abs(asked.moment_nm.z()) * farthest / std::max(1e-9, xx + yy);
  const double shear_n = asked.force_n.head<2>().norm() / cups + twist_n;
  double most_n = 0;
  for (const Vector3& cup : tool.cups_m) {
    // The tip's z axis points out of the tool: a cup pulls against it.
    const double pull_n = -asked.force_n.z() / cups - asked.moment_nm.x() * cup.y() / std::max(1e-9, yy) +
                          asked.moment_nm.y() * cup.x() / std::max(1e-9, xx);
    most_n = std::max(most_n, pull_n);
  }
  return (most_n + shear_n / kFriction) / tool.cup_force_n;
}

}  // namespace

double grip_use(model::RobotModel& model, const world::Tool& tool, const Load& load, double mass_kg,
                const motion::Trajectory& trajectory) {
  if (trajectory.empty() || tool.cups_m.empty()) return 0;
  const Time begin = trajectory.front().start;
  const auto steps = static_cast<int>(std::ceil(to_s(trajectory.back().end() - begin) / kStep_s));
  const auto pose_at = [&](int step) {
    return model.world_from_tip(motion::sample(trajectory, begin + from_s(kStep_s * step), model.axes()).position);
  };
  std::array<Pose, 3> poses{pose_at(0), pose_at(1), pose_at(2)};
  double worst = 0;
  for (int step = 3; step <= steps + 1; ++step) {
    worst = std::max(worst, use(tool, wrench(poses, load, mass_kg)));
    poses = {poses[1], poses[2], pose_at(step)};
  }
  return worst;
}

double torque_use(model::RobotModel& model, const world::Robot& robot, const Load& load, double mass_kg,
                  const motion::Trajectory& trajectory) {
  if (trajectory.empty()) return 0;
  const Vector3 tip_from_com = load.offset_in_tip_m + Vector3(0, 0, 0.5 * load.size_m.z());
  const Vector3 com = robot.tool.flange_from_tip * tip_from_com;
  const model::Payload payload{mass_kg, {com.x(), com.y(), com.z()}};
  AxisVector torque_nm = AxisVector::Zero(model.axes());
  double worst = 0;
  for (Time time = trajectory.front().start; time < trajectory.back().end(); time += from_s(kStep_s)) {
    const AxisState state = motion::sample(trajectory, time, model.axes());
    model.inverse_dynamics(state.position, state.speed, state.acceleration, payload, torque_nm);
    worst = std::max(worst, torque_nm.cwiseAbs().cwiseQuotient(robot.limits.torque_nm).maxCoeff());
  }
  return worst;
}

}  // namespace pons::skills
