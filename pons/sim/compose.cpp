#include "pons/sim/compose.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>

#include "pons/sim/check_scene.hpp"

namespace pons::sim {
namespace {

constexpr mjtSize kArenaBytes = 48 << 20;
constexpr double kParkX = 40, kParkY = 40, kParkZ = 5, kParkPitch = 1.5;  // m; far from anything a camera sees

constexpr int kArmBit = 4;  // of every arm: what it meets of scene and parcels

// What one arm meets of the others.
int bit_of(std::size_t arm) { return kArmBit << (1 + arm); }

std::string arm_prefix(const world::World& station) { return station.arm + "/"; }
std::string tool_prefix(const world::World& station) { return station.arm + "_tool/"; }

void set_options(mjSpec* spec, const world::World& world) {
  set_solver(spec, world.physics_step_s);
  spec->option.enableflags |= mjENBL_SLEEP;
  spec->option.sleep_tolerance = 1e-3;
  spec->memory = kArenaBytes;
}

std::string drive_name(const world::World& station, Eigen::Index axis) {
  return fmt::format("{}_drive_{}", station.arm, axis);
}

// Arms of one belt meet each other; the parts of one arm do not.
void let_meet(mjsBody* body, std::size_t arm, std::size_t arms) {
  int others = 0;
  for (std::size_t other = 0; other < arms; ++other) others |= other == arm ? 0 : bit_of(other);
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_GEOM, 1); e != nullptr; e = mjs_nextChild(body, e, 1)) {
    mjsGeom* geom = mjs_asGeom(e);
    if ((geom->contype & kArmBit) == 0) continue;
    geom->contype |= bit_of(arm);
    geom->conaffinity |= others;
  }
}

void paint_arm(mjsBody* body) {
  int index = 0;
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_GEOM, 1); e != nullptr; e = mjs_nextChild(body, e, 1)) {
    mjsGeom* geom = mjs_asGeom(e);
    geom->contype = kArmBit;
    geom->conaffinity = 0;
    geom->group = 1;
    const bool joint_cover = index++ % 3 != 1;
    const float shade[3] = {joint_cover ? 0.28f : 0.80f, joint_cover ? 0.42f : 0.82f, joint_cover ? 0.58f : 0.84f};
    for (int i = 0; i < 3; ++i) geom->rgba[i] = shade[i];
    geom->rgba[3] = 1;
  }
}

Expected<void> add_drives(mjSpec* scene, const world::World& station) {
  const world::Robot& robot = station.robot;
  Eigen::Index axis = 0;
  for (mjsElement* e = mjs_firstElement(scene, mjOBJ_JOINT); e != nullptr; e = mjs_nextElement(scene, e)) {
    // MuJoCo's own std::string is of another library: only its accessor may look inside.
    const std::string joint_name = mjs_getString(mjs_getName(e));
    if (!joint_name.starts_with(arm_prefix(station))) continue;
    mjsJoint* joint = mjs_asJoint(e);
    if (axis >= robot.limits.torque_nm.size()) break;
    joint->armature = robot.rotor_inertia_kg_m2[axis];
    joint->range[0] = robot.limits.position_min[axis];
    joint->range[1] = robot.limits.position_max[axis];
    joint->limited = mjLIMITED_TRUE;
    joint->actfrclimited = mjLIMITED_FALSE;
    mjsActuator* motor = mjs_addActuator(scene, nullptr);
    mjs_setToMotor(motor);
    mjs_setName(motor->element, drive_name(station, axis).c_str());
    mjs_setString(motor->target, joint_name.c_str());
    motor->trntype = mjTRN_JOINT;
    motor->ctrllimited = mjLIMITED_TRUE;
    motor->ctrlrange[0] = -robot.limits.torque_nm[axis];
    motor->ctrlrange[1] = robot.limits.torque_nm[axis];
    ++axis;
  }
  if (axis != robot.home.size()) {
    return fail(fmt::format("the URDF has {} moving joints, world.yaml limits for {}", axis, robot.home.size()),
                robot.urdf.string(), "give one limit a joint");
  }
  return {};
}

// What is attached must live until the scene is compiled.
struct Attached {
  SpecPtr arm, tool;
};

Expected<Attached> add_robot(mjSpec* scene, const world::World& station, std::size_t index, std::size_t arms) {
  const world::Robot& robot = station.robot;
  auto arm = parse(robot.urdf);
  if (!arm) return std::unexpected(arm.error());
  auto tool = parse(robot.tool.mjcf);
  if (!tool) return std::unexpected(tool.error());
  mjsFrame* base = mjs_addFrame(mjs_findBody(scene, "world"), nullptr);
  to_mujoco(robot.world_from_base, base->pos, base->quat);
  auto arm_root = attach(base, arm->get(), arm_prefix(station).c_str(), robot.urdf);
  if (!arm_root) return std::unexpected(arm_root.error());
  (*arm_root)->sleep = mjSLEEP_AUTO;
  paint_arm(*arm_root);
  let_meet(*arm_root, index, arms);

  mjsBody* flange = mjs_findBody(scene, (arm_prefix(station) + robot.flange_link).c_str());
  if (flange == nullptr) {
    return fail(fmt::format("link '{}' is missing", robot.flange_link), robot.urdf.string(),
                "name the last link as robot.flange_link in world.yaml");
  }
  mjsFrame* at_flange = mjs_addFrame(flange, nullptr);
  auto tool_root = attach(at_flange, tool->get(), tool_prefix(station).c_str(), robot.tool.mjcf);
  if (!tool_root) return std::unexpected(tool_root.error());
  let_meet(*tool_root, index, arms);
  if (auto added = add_drives(scene, station); !added) return std::unexpected(added.error());
  return Attached{std::move(*arm), std::move(*tool)};
}

mjsGeom* add_parcel_geom(mjsBody* body, const std::string& name, mjtGeom type, int bits) {
  mjsGeom* geom = mjs_addGeom(body, nullptr);
  mjs_setName(geom->element, name.c_str());
  geom->type = type;
  geom->size[0] = geom->size[1] = geom->size[2] = 0.05;
  geom->contype = bits;
  geom->conaffinity = bits == 0 ? 0 : 6;
  geom->condim = 4;
  geom->mass = 0;
  geom->group = 1;
  return geom;
}

// A square that shows a texture of its own: what is printed on it changes from parcel to parcel.
void add_label(mjSpec* scene, mjsBody* body, const std::string& label) {
  mjsTexture* texture = mjs_addTexture(scene, nullptr);
  mjs_setName(texture->element, label.c_str());
  texture->type = mjTEXTURE_2D;
  texture->builtin = mjBUILTIN_FLAT;
  for (double& channel : texture->rgb1) channel = 1;
  texture->width = texture->height = kLabelPixels;
  texture->nchannel = 3;
  mjsMaterial* material = mjs_addMaterial(scene, nullptr);
  mjs_setName(material->element, label.c_str());
  mjs_setInStringVec(material->textures, mjTEXROLE_RGB, label.c_str());
  material->specular = 0;
  material->shininess = 0;
  mjs_setString(add_parcel_geom(body, label, mjGEOM_BOX, 0)->material, label.c_str());
}

enum class Labels : std::uint8_t { kOne, kTwo };

void add_slot(mjSpec* scene, int index, Labels labels) {
  mjsBody* body = mjs_addBody(mjs_findBody(scene, "world"), nullptr);
  const std::string name = fmt::format("parcel_{}", index);
  mjs_setName(body->element, name.c_str());
  body->pos[0] = kParkX;
  body->pos[1] = kParkY + kParkPitch * index;
  body->pos[2] = kParkZ;
  body->mass = 1;
  // Unset, the centre of mass would come from geoms that have no mass.
  for (double& coordinate : body->ipos) coordinate = 0;
  for (double& inertia : body->inertia) inertia = 0.01;
  body->explicitinertial = 1;
  body->gravcomp = 1;
  body->sleep = mjSLEEP_ALLOWED;
  mjs_addFreeJoint(body);

  add_parcel_geom(body, name + "_main", mjGEOM_BOX, 2);
  add_parcel_geom(body, name + "_rim", mjGEOM_BOX, 2);
  add_label(scene, body, name + "_label");
  if (labels == Labels::kTwo) add_label(scene, body, name + "_second_label");
}

// Between which two, and how they lie to each other, is written when two cling.
void add_cling(mjSpec* scene) {
  mjsEquality* weld = mjs_addEquality(scene, nullptr);
  mjs_setName(weld->element, "cling");
  weld->type = mjEQ_WELD;
  weld->objtype = mjOBJ_BODY;
  weld->active = 0;
  mjs_setString(weld->name1, "parcel_0");
  mjs_setString(weld->name2, "parcel_1");
}

void add_cameras(mjSpec* scene, const world::World& world) {
  Eigen::Matrix3d gl_from_optical = Eigen::Vector3d(1, -1, -1).asDiagonal();
  for (const world::CameraSpec& spec : world.cameras) {
    mjsCamera* camera = mjs_addCamera(mjs_findBody(scene, "world"), nullptr);
    mjs_setName(camera->element, ("camera/" + spec.name).c_str());
    Pose world_from_gl = spec.world_from_optical;
    world_from_gl.linear() = spec.world_from_optical.linear() * gl_from_optical;
    to_mujoco(world_from_gl, camera->pos, camera->quat);
    camera->fovy = spec.fovy_rad * 180 / std::numbers::pi;  // in degrees always
  }
}

// -1 turned into an error that names what is missing.
Expected<int> id_of(const mjModel* model, mjtObj type, const std::string& name, const std::filesystem::path& file) {
  const int id = mj_name2id(model, type, name.c_str());
  if (id >= 0) return id;
  return fail(fmt::format("{} '{}' is missing", mju_type2Str(type), name), file.string(), "add it");
}

void find_drives(ComposedArm& arm, const mjModel* model, const world::World& station) {
  for (Eigen::Index axis = 0; axis < station.robot.home.size(); ++axis) {
    const int actuator = mj_name2id(model, mjOBJ_ACTUATOR, drive_name(station, axis).c_str());
    const int joint = model->actuator_trnid[2 * actuator];
    arm.actuator.push_back(actuator);
    arm.qpos.push_back(model->jnt_qposadr[joint]);
    arm.dof.push_back(model->jnt_dofadr[joint]);
  }
}

Expected<void> find_tool(ComposedArm& arm, const mjModel* model, const world::World& station) {
  const auto& file = station.robot.tool.mjcf;
  const std::string tool = tool_prefix(station);
  for (std::size_t i = 0; i < station.robot.tool.cups_m.size(); ++i) {
    auto body = id_of(model, mjOBJ_BODY, fmt::format("{}cup_{}", tool, i), file);
    auto geom = id_of(model, mjOBJ_GEOM, fmt::format("{}lip_{}", tool, i), file);
    auto actuator = id_of(model, mjOBJ_ACTUATOR, fmt::format("{}vacuum_{}", tool, i), file);
    for (const auto* id : {&body, &geom, &actuator}) {
      if (!*id) return std::unexpected(id->error());
    }
    arm.cups.push_back({*body, *geom, *actuator});
  }
  auto site = id_of(model, mjOBJ_SITE, tool + "wrist", file);
  auto force = id_of(model, mjOBJ_SENSOR, tool + "wrist_force", file);
  auto torque = id_of(model, mjOBJ_SENSOR, tool + "wrist_torque", file);
  for (const auto* id : {&site, &force, &torque}) {
    if (!*id) return std::unexpected(id->error());
  }
  arm.wrist_site = *site;
  arm.tool_body = model->site_bodyid[*site];
  arm.force_sensor = model->sensor_adr[*force];
  arm.torque_sensor = model->sensor_adr[*torque];
  return {};
}

Expected<void> find_arms(Composed& cell, const world::World& world) {
  const mjModel* model = cell.model.get();
  for (const world::World& station : world.arms()) {
    ComposedArm& arm = cell.arms.emplace_back();
    find_drives(arm, model, station);
    if (auto found = find_tool(arm, model, station); !found) return found;
    const int own = model->body_rootid[arm.tool_body];
    for (int geom = 0; geom < model->ngeom; ++geom) {
      if (model->body_rootid[model->geom_bodyid[geom]] == own && (model->geom_contype[geom] & kArmBit) != 0)
        arm.geoms.push_back(geom);
    }
  }
  return {};
}

void find_slots(Composed& cell) {
  const mjModel* model = cell.model.get();
  for (int i = 0; i < kSlots; ++i) {
    const std::string name = fmt::format("parcel_{}", i);
    Slot slot;
    slot.body = mj_name2id(model, mjOBJ_BODY, name.c_str());
    slot.qpos = model->jnt_qposadr[model->body_jntadr[slot.body]];
    slot.dof = model->body_dofadr[slot.body];
    slot.main = mj_name2id(model, mjOBJ_GEOM, (name + "_main").c_str());
    slot.rim = mj_name2id(model, mjOBJ_GEOM, (name + "_rim").c_str());
    slot.label = mj_name2id(model, mjOBJ_GEOM, (name + "_label").c_str());
    slot.texture = mj_name2id(model, mjOBJ_TEXTURE, (name + "_label").c_str());
    slot.second_label = mj_name2id(model, mjOBJ_GEOM, (name + "_second_label").c_str());
    slot.second_texture = mj_name2id(model, mjOBJ_TEXTURE, (name + "_second_label").c_str());
    cell.slots.push_back(slot);
  }
}

void classify(Composed& cell) {
  const mjModel* model = cell.model.get();
  cell.parts.assign(static_cast<std::size_t>(model->ngeom), Part::kFixed);
  cell.slot_of_geom.assign(static_cast<std::size_t>(model->ngeom), -1);
  for (int geom = 0; geom < model->ngeom; ++geom) {
    if ((model->geom_contype[geom] & kArmBit) != 0) cell.parts[static_cast<std::size_t>(geom)] = Part::kArm;
  }
  for (const ComposedArm& arm : cell.arms) {
    for (const Cup& cup : arm.cups) cell.parts[static_cast<std::size_t>(cup.geom)] = Part::kCup;
  }
  cell.parts[static_cast<std::size_t>(cell.belt_geom)] = Part::kBelt;
  for (int i = 0; i < kSlots; ++i) {
    const Slot& slot = cell.slots[static_cast<std::size_t>(i)];
    for (const int geom : {slot.main, slot.rim, slot.label, slot.second_label}) {
      if (geom < 0) continue;
      cell.parts[static_cast<std::size_t>(geom)] = Part::kParcel;
      cell.slot_of_geom[static_cast<std::size_t>(geom)] = i;
    }
  }
}

Expected<Composed> compile_and_find(mjSpec* scene, const world::World& world) {
  Composed cell;
  cell.model.reset(mj_compile(scene, nullptr));
  if (!cell.model)
    return fail(one_line(mjs_getError(scene)), world.scene_mjcf.string(), "mend the scene, the URDF or the tool");
  const mjModel* model = cell.model.get();
  auto belt = id_of(model, mjOBJ_GEOM, "belt", world.scene_mjcf);
  if (!belt) return std::unexpected(belt.error());
  cell.belt_geom = *belt;
  auto picture = id_of(model, mjOBJ_CAMERA, "picture", world.scene_mjcf);
  if (!picture) return std::unexpected(picture.error());
  cell.picture_camera = *picture;
  for (const world::CameraSpec& camera : world.cameras) {
    cell.cameras.push_back(mj_name2id(model, mjOBJ_CAMERA, ("camera/" + camera.name).c_str()));
  }
  if (auto found = find_arms(cell, world); !found) return std::unexpected(found.error());
  find_slots(cell);
  cell.cling = mj_name2id(model, mjOBJ_EQUALITY, "cling");
  classify(cell);
  if (auto good = check_scene(cell, world); !good) return std::unexpected(good.error());
  return cell;
}

}  // namespace

Expected<Composed> compose(const world::World& world, const world::FaultPlan& faults) {
  install_message_handler();
  try {
    auto scene = parse(world.scene_mjcf);
    if (!scene) return std::unexpected(scene.error());
    set_options(scene->get(), world);
    const auto arms = world.arms();
    std::vector<Attached> attached;
    for (std::size_t i = 0; i < arms.size(); ++i) {
      auto added = add_robot(scene->get(), arms[i], i, arms.size());
      if (!added) return std::unexpected(added.error());
      attached.push_back(std::move(*added));
    }
    const Labels labels = faults[world::Fault::kDoubleLabel].often > 0 ? Labels::kTwo : Labels::kOne;
    for (int i = 0; i < kSlots; ++i) add_slot(scene->get(), i, labels);
    if (faults[world::Fault::kDoublePick].often > 0) add_cling(scene->get());
    add_cameras(scene->get(), world);
    return compile_and_find(scene->get(), world);
  } catch (const std::exception& error) {
    return fail(error.what(), world.scene_mjcf.string(), "mend the scene, the URDF or the tool");
  }
}

}  // namespace pons::sim
