// MuJoCo's C handles with owners, and its messages as errors. Private to pons/sim.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"

namespace pons::sim {

struct MujocoDelete {
  void operator()(mjSpec* spec) const { mj_deleteSpec(spec); }
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using SpecPtr = std::unique_ptr<mjSpec, MujocoDelete>;
using ModelPtr = std::unique_ptr<mjModel, MujocoDelete>;
using DataPtr = std::unique_ptr<mjData, MujocoDelete>;

// MuJoCo's own handler writes a file and ends the process. Ours keeps the text for take_message() of the thread that
// caused it, and throws std::runtime_error for errors. The library has one handler for all; installing twice is
// harmless.
void install_message_handler();
// The newest warning or error of this thread, empty when there was none since the last call.
[[nodiscard]] std::string take_message();

// MuJoCo says what and where on lines of their own.
[[nodiscard]] std::string one_line(std::string text);
// MJCF or URDF. Errors: no such file, broken.
[[nodiscard]] Expected<SpecPtr> parse(const std::filesystem::path& file);
// Attaches the first body of `child` at a frame, and keeps child's names under `prefix`.
[[nodiscard]] Expected<mjsBody*> attach(mjsFrame* frame, mjSpec* child, const char* prefix,
                                        const std::filesystem::path& file);

// Step, integrator and contact solver, the same in every scene.
void set_solver(mjSpec* spec, double step_s);

// Pose to MuJoCo's position and quaternion (w first), and back.
void to_mujoco(const Pose& pose, double position[3], double quaternion[4]);
[[nodiscard]] Pose from_mujoco(const double position[3], const double quaternion[4]);

// Digest of every position and speed.
[[nodiscard]] std::uint64_t digest_of(const mjModel* model, const mjData* data);

}  // namespace pons::sim
