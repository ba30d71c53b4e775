#include "pons/sim/mujoco_kit.hpp"

#include <span>
#include <stdexcept>
#include <utility>

#include "pons/core/digest.hpp"

namespace pons::sim {
namespace {

thread_local std::string last_message;

void keep(const mjLogMessage* message) {
  if (message->level < mjLOG_WARNING) return;
  last_message = message->subject;
  // The library leaves the process after an error handler returns.
  if (message->level == mjLOG_ERROR) throw std::runtime_error(last_message);
}

}  // namespace

void install_message_handler() { mju_setLogHandler(keep); }

std::string take_message() { return std::exchange(last_message, {}); }

void to_mujoco(const Pose& pose, double position[3], double quaternion[4]) {
  const Eigen::Quaterniond q(pose.linear());
  for (int i = 0; i < 3; ++i) position[i] = pose.translation()[i];
  quaternion[0] = q.w();
  quaternion[1] = q.x();
  quaternion[2] = q.y();
  quaternion[3] = q.z();
}

Pose from_mujoco(const double position[3], const double quaternion[4]) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(quaternion[0], quaternion[1], quaternion[2], quaternion[3]).toRotationMatrix();
  pose.translation() = Vector3(position[0], position[1], position[2]);
  return pose;
}

std::uint64_t digest_of(const mjModel* model, const mjData* data) {
  Digest digest;
  digest.add(std::span<const double>(data->qpos, static_cast<std::size_t>(model->nq)));
  digest.add(std::span<const double>(data->qvel, static_cast<std::size_t>(model->nv)));
  return digest.value();
}

}  // namespace pons::sim
