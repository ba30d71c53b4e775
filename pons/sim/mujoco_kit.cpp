#include "pons/sim/mujoco_kit.hpp"

#include <algorithm>
#include <span>
#include <stdexcept>
#include <system_error>
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

std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

Expected<SpecPtr> parse(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(file, code)) {
    return fail("there is no such file", file.string(), "name a file that exists in world.yaml");
  }
  char text[1024] = "";
  SpecPtr spec(mj_parseXML(file.c_str(), nullptr, text, sizeof text));
  if (!spec) return fail(one_line(text), file.string(), "mend the XML there");
  return spec;
}

Expected<mjsBody*> attach(mjsFrame* frame, mjSpec* child, const char* prefix, const std::filesystem::path& file) {
  mjsBody* root = mjs_asBody(mjs_firstChild(mjs_findBody(child, "world"), mjOBJ_BODY, 0));
  if (root == nullptr) return fail("there is no body", file.string(), "give it one root body");
  mjsElement* attached = mjs_attach(frame->element, root->element, prefix, "");
  if (attached == nullptr) return fail(one_line(mjs_getError(mjs_getSpec(frame->element))), file.string(), "mend it");
  return mjs_asBody(attached);
}

void set_solver(mjSpec* spec, double step_s) {
  mjOption& option = spec->option;
  option.timestep = step_s;
  option.integrator = mjINT_IMPLICITFAST;
  option.cone = mjCONE_ELLIPTIC;
  option.solver = mjSOL_NEWTON;
  option.iterations = 30;
  option.ls_iterations = 30;
  option.impratio = 3;
  spec->compiler.fusestatic = 0;
}

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
