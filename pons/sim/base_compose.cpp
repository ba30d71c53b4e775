#include "pons/sim/base_compose.hpp"

#include <fmt/format.h>

#include <exception>
#include <string>
#include <vector>

#include "pons/sim/lidar.hpp"

namespace pons::sim {
namespace {

constexpr int kBaseBits = 4;
constexpr double kSlippery = 0.002;  // a caster turns with whatever it is pushed along
constexpr double kWheelFriction = 0.8;

// The joint that a body hangs on, if any.
mjsJoint* joint_of(mjsBody* body) { return mjs_asJoint(mjs_firstChild(body, mjOBJ_JOINT, 0)); }

void paint(mjsGeom* geom, float grey) {
  for (int i = 0; i < 3; ++i) geom->rgba[i] = grey + 0.04f * static_cast<float>(i);
  geom->rgba[3] = 1;
}

// What the URDF does not say: who touches whom, how, and how large the wheels really are.
void finish_geoms(mjsBody* body, int wheel, const world::Base& base) {
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_GEOM, 0); e != nullptr; e = mjs_nextChild(body, e, 0)) {
    mjsGeom* geom = mjs_asGeom(e);
    geom->contype = kBaseBits;
    geom->conaffinity = 0;
    geom->group = kBaseGroup;
    paint(geom, wheel >= 0 ? 0.15f : 0.55f);
    if (geom->type != mjGEOM_SPHERE) continue;
    geom->priority = 1;
    geom->friction[0] = wheel >= 0 ? kWheelFriction : kSlippery;
    if (wheel >= 0) geom->size[0] *= 1 + base.wheel_error[static_cast<std::size_t>(wheel)];
  }
}

Expected<void> add_base(mjSpec* scene, mjSpec* urdf, const world::World& world) {
  const world::Base& base = *world.base;
  mjsFrame* at = mjs_addFrame(mjs_findBody(scene, "world"), nullptr);
  to_mujoco(pose_xyz_yaw(base.start.x, base.start.y, 0, base.start.yaw), at->pos, at->quat);
  auto root = attach(at, urdf, "base/", world.robot.urdf);
  if (!root) return std::unexpected(root.error());
  mjs_setName((*root)->element, "base");
  mjsJoint* freedom = mjs_addFreeJoint(*root);
  mjs_setName(freedom->element, "freedom");
  finish_geoms(*root, -1, base);
  int wheels = 0;
  for (mjsElement* e = mjs_firstChild(*root, mjOBJ_BODY, 1); e != nullptr; e = mjs_nextChild(*root, e, 1)) {
    mjsBody* part = mjs_asBody(e);
    mjsJoint* joint = joint_of(part);
    finish_geoms(part, joint == nullptr ? -1 : wheels, base);
    if (joint == nullptr) continue;
    if (wheels == 2)
      return fail("more than two joints move", world.robot.urdf.string(), "drive two wheels, fix the rest");
    joint->armature = world.robot.rotor_inertia_kg_m2[wheels];
    joint->limited = mjLIMITED_FALSE;
    joint->actfrclimited = mjLIMITED_FALSE;
    mjsActuator* motor = mjs_addActuator(scene, nullptr);
    mjs_setToMotor(motor);
    mjs_setName(motor->element, fmt::format("drive_{}", wheels).c_str());
    const std::string joint_name = mjs_getString(mjs_getName(joint->element));
    mjs_setString(motor->target, joint_name.c_str());
    motor->trntype = mjTRN_JOINT;
    motor->ctrllimited = mjLIMITED_TRUE;
    motor->ctrlrange[0] = -world.robot.limits.torque_nm[wheels];
    motor->ctrlrange[1] = world.robot.limits.torque_nm[wheels];
    ++wheels;
  }
  if (wheels == 2) return {};
  return fail(fmt::format("{} joints move", wheels), world.robot.urdf.string(), "a base has two driven wheels");
}

Expected<ComposedBase> compile_and_find(mjSpec* scene, const world::World& world) {
  ComposedBase base;
  base.model.reset(mj_compile(scene, nullptr));
  if (!base.model) return fail(one_line(mjs_getError(scene)), world.scene_mjcf.string(), "mend the scene or the URDF");
  const mjModel* model = base.model.get();
  base.base_body = mj_name2id(model, mjOBJ_BODY, "base");
  base.floor_geom = mj_name2id(model, mjOBJ_GEOM, "floor");
  base.picture_camera = mj_name2id(model, mjOBJ_CAMERA, "picture");
  if (base.floor_geom < 0) return fail("geom 'floor' is missing", world.scene_mjcf.string(), "add it");
  if (base.picture_camera < 0) return fail("camera 'picture' is missing", world.scene_mjcf.string(), "add it");
  const int freedom = mj_name2id(model, mjOBJ_JOINT, "freedom");
  base.free_qpos = model->jnt_qposadr[freedom];
  base.free_dof = model->jnt_dofadr[freedom];
  for (std::size_t i = 0; i < 2; ++i) {
    base.actuator[i] = mj_name2id(model, mjOBJ_ACTUATOR, fmt::format("drive_{}", i).c_str());
    const int joint = model->actuator_trnid[2 * base.actuator[i]];
    base.wheel_qpos[i] = model->jnt_qposadr[joint];
    base.wheel_dof[i] = model->jnt_dofadr[joint];
  }
  return base;
}

}  // namespace

Expected<ComposedBase> compose_base(const world::World& world) {
  install_message_handler();
  try {
    auto scene = parse(world.scene_mjcf);
    if (!scene) return std::unexpected(scene.error());
    auto urdf = parse(world.robot.urdf);
    if (!urdf) return std::unexpected(urdf.error());
    // Friction is a constraint that gives way a little: wheels creep under load, as tyres do.
    set_solver(scene->get(), world.physics_step_s);
    if (auto added = add_base(scene->get(), urdf->get(), world); !added) return std::unexpected(added.error());
    return compile_and_find(scene->get(), world);
  } catch (const std::exception& error) {
    return fail(error.what(), world.scene_mjcf.string(), "mend the scene or the URDF");
  }
}

}  // namespace pons::sim
