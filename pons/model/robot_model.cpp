#include "pons/model/robot_model.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <array>
#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "pons/core/gravity.hpp"
#include "pons/model/inverse.hpp"

namespace pons::model {
namespace {

Pose pose_of(const pinocchio::SE3& m) {
  Pose pose = Pose::Identity();
  pose.linear() = m.rotation();
  pose.translation() = m.translation();
  return pose;
}

pinocchio::SE3 se3_of(const Pose& pose) { return {pose.linear(), pose.translation()}; }

// Keeps what the URDF parser would print, for the one line of error. Restores the printer that was there.
class ParserMessages final : public console_bridge::OutputHandler {
 public:
  ParserMessages() : before_(console_bridge::getOutputHandler()) { console_bridge::useOutputHandler(this); }
  ~ParserMessages() override { console_bridge::useOutputHandler(before_); }
  ParserMessages(const ParserMessages&) = delete;
  ParserMessages& operator=(const ParserMessages&) = delete;
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first.empty()) first = text;
  }
  std::string first;

 private:
  console_bridge::OutputHandler* before_;
};

pinocchio::Inertia point_mass(double mass_kg, const Vector3& com_m) {
  return {mass_kg, com_m, pinocchio::Symmetric3::Zero()};
}

}  // namespace

// Vectors are dynamic although AxisVector would do: Pinocchio's libraries are compiled for them.
struct RobotModel::Impl {
  world::Robot robot;
  pinocchio::Model model;
  pinocchio::Data data;
  pinocchio::JointIndex last_joint = 0;
  pinocchio::SE3 last_joint_from_flange;
  pinocchio::SE3 last_joint_from_tip;
  pinocchio::Inertia last_inertia;  // last link and tool, without payload
  std::vector<pinocchio::FrameIndex> capsule_frames;
  std::vector<std::pair<pinocchio::FrameIndex, pinocchio::FrameIndex>> links;  // each with the one it hangs on
  Eigen::VectorXd q, v, a;
  Eigen::VectorXd placed_at;  // the q that data.oMi holds; not a number: none
  bool axes_placed = false;   // and data.J
  std::optional<InverseKinematics> inverse;

  Impl(world::Robot robot_in, const pinocchio::Model& model_in)
      : robot(std::move(robot_in)), model(model_in), data(model) {
    model.gravity.linear() = robot.world_from_base.linear().transpose() * Vector3(0, 0, -kGravity_m_s2);
    model.armature = robot.rotor_inertia_kg_m2;
    if (robot.reflected_inertia_kg_m2.size() > 0) model.armature += robot.reflected_inertia_kg_m2;
    last_joint_from_flange.setIdentity();
    if (!robot.flange_link.empty()) {
      const auto flange = model.getFrameId(robot.flange_link);
      last_joint = model.frames[flange].parentJoint;
      last_joint_from_flange = model.frames[flange].placement;
    }
    last_joint_from_tip = last_joint_from_flange * se3_of(robot.tool.flange_from_tip);
    last_inertia =
        model.inertias[last_joint] + last_joint_from_flange.act(point_mass(robot.tool.mass_kg, robot.tool.com_m));
    model.inertias[last_joint] = last_inertia;
    for (const auto& capsule : robot.capsules)
      capsule_frames.push_back(model.getFrameId(capsule.link, pinocchio::BODY));
    find_links();
    q = v = a = placed_at = Eigen::VectorXd::Zero(model.nv);
    forget();
    inverse.emplace(chain());
  }

  // Copies what was set up and makes its own scratch pad.
  Impl(const Impl& other)
      : robot(other.robot),
        model(other.model),
        data(model),
        last_joint(other.last_joint),
        last_joint_from_flange(other.last_joint_from_flange),
        last_joint_from_tip(other.last_joint_from_tip),
        last_inertia(other.last_inertia),
        capsule_frames(other.capsule_frames),
        links(other.links),
        q(other.q),
        v(other.v),
        a(other.a),
        placed_at(other.placed_at),
        inverse(other.inverse) {
    forget();
  }
  Impl& operator=(const Impl&) = delete;
  ~Impl() = default;

  void find_links() {
    for (pinocchio::FrameIndex index = 1; index < model.frames.size(); ++index) {
      if (model.frames[index].type != pinocchio::BODY) continue;
      auto parent = model.frames[index].parentFrame;  // a joint's
      while (parent != 0 && model.frames[parent].type != pinocchio::BODY) parent = model.frames[parent].parentFrame;
      if (parent != 0) links.emplace_back(index, parent);
    }
  }

  // The payload joins the inertia of the last moving link.
  void carry(const Payload& payload) PONS_NONBLOCKING {
    const Vector3 com(payload.com_m[0], payload.com_m[1], payload.com_m[2]);
    model.inertias[last_joint] = last_inertia;
    if (payload.mass_kg <= 0) return;
    constexpr double kDensityKgM3 = 600;
    const double side_m = std::cbrt(payload.mass_kg / kDensityKgM3);
    const Eigen::Matrix3d cube = Eigen::Matrix3d::Identity() * (payload.mass_kg * side_m * side_m / 6);
    model.inertias[last_joint] += last_joint_from_flange.act(pinocchio::Inertia(payload.mass_kg, com, cube));
  }

  // A tick asks for several things of one q: what was reckoned for it stays until another is asked for.
  void place_links(const AxisVector& at) PONS_NONBLOCKING {
    if (placed_at == at) return;
    placed_at = at;
    axes_placed = false;
    pinocchio::forwardKinematics(model, data, placed_at);
  }
  void place_axes(const AxisVector& at) PONS_NONBLOCKING {
    if (axes_placed && placed_at == at) return;
    placed_at = at;
    axes_placed = true;
    pinocchio::computeJointJacobians(model, data, placed_at);
  }
  void forget() PONS_NONBLOCKING {
    placed_at.setConstant(std::numeric_limits<double>::quiet_NaN());
    axes_placed = false;
  }

  Jacobian tip_jacobian(const AxisVector& at) {
    if (last_joint == 0) return Jacobian::Zero(6, model.nv);  // no axis moves it
    place_axes(at);
    const pinocchio::SE3 base_from_tip = data.oMi[last_joint] * last_joint_from_tip;
    Jacobian jacobian(6, model.nv);
    const Eigen::Matrix3d turn = robot.world_from_base.linear();
    for (Eigen::Index axis = 0; axis < model.nv; ++axis) {
      // data.J holds each axis's twist at the base origin, in base axes; move it to the tip, turn it to the world.
      const Vector3 angular = data.J.col(axis).tail<3>();
      const Vector3 linear = data.J.col(axis).head<3>() + angular.cross(base_from_tip.translation());
      jacobian.col(axis).head<3>() = turn * linear;
      jacobian.col(axis).tail<3>() = turn * angular;
    }
    return jacobian;
  }

  // Says no more than was looked at: the seed's branch alone, and by iteration there is no proof.
  [[nodiscard]] Error unreached(const Pose& world_from_tip, Among among) const {
    const Vector3& p = world_from_tip.translation();
    const std::string pose = fmt::format("({:.3f}, {:.3f}, {:.3f}) m in that orientation", p.x(), p.y(), p.z());
    const bool seeds = among == Among::kBranchOfSeed;
    if (!inverse->closed_form()) {
      return {fmt::format("iteration{} did not bring the tip to {} within the position limits",
                          seeds ? " near the seed" : "", pose),
              robot.name, "choose a pose farther inside the arm's reach, or begin elsewhere"};
    }
    return {fmt::format("the tip cannot reach {} within the position limits{}", pose,
                        seeds ? " on the branch that the arm begins on" : ""),
            robot.name,
            seeds ? "choose a pose inside the arm's reach, or begin on another branch"
                  : "choose a pose inside the arm's reach, or wider position limits"};
  }

  // What inverse kinematics needs of the model: the axes with every joint at zero.
  Chain chain() {
    const Jacobian at_zero = tip_jacobian(AxisVector::Zero(model.nv));
    std::array<Joint, kMaxAxes> joints;
    for (Eigen::Index axis = 0; axis < model.nv; ++axis) {
      Joint& joint = joints[static_cast<std::size_t>(axis)];
      joint.revolute = at_zero.col(axis).tail<3>().squaredNorm() > 0.5;
      joint.axis = joint.revolute ? at_zero.col(axis).tail<3>() : at_zero.col(axis).head<3>();
      joint.point = robot.world_from_base * data.oMi[static_cast<std::size_t>(axis) + 1].translation();
    }
    const Pose tip = robot.world_from_base * pose_of(data.oMi[last_joint] * last_joint_from_tip);
    return {std::span(joints).first(static_cast<std::size_t>(model.nv)), tip, robot.limits};
  }
};

RobotModel::RobotModel(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RobotModel::RobotModel(RobotModel&&) noexcept = default;
RobotModel& RobotModel::operator=(RobotModel&&) noexcept = default;
RobotModel::~RobotModel() = default;

namespace {

// The same, with every joint that turns without end as one that counts its turns: one number an axis, as encoders have
// it.
pinocchio::Model counting_turns(const pinocchio::Model& model) {
  if (model.nq == model.nv) return model;
  pinocchio::Model counting;
  for (std::size_t i = 1; i < static_cast<std::size_t>(model.njoints); ++i) {
    const std::string kind = model.joints[i].shortname();
    pinocchio::JointModel joint = model.joints[i];
    if (kind == "JointModelRUBX") joint = pinocchio::JointModelRX();
    if (kind == "JointModelRUBY") joint = pinocchio::JointModelRY();
    if (kind == "JointModelRUBZ") joint = pinocchio::JointModelRZ();
    if (const auto* turning = boost::get<pinocchio::JointModelRevoluteUnboundedUnaligned>(&model.joints[i]))
      joint = pinocchio::JointModelRevoluteUnaligned(turning->axis);
    const auto added = counting.addJoint(model.parents[i], joint, model.jointPlacements[i], model.names[i]);
    counting.appendBodyToJoint(added, model.inertias[i]);
  }
  counting.frames = model.frames;
  counting.nframes = model.nframes;
  return counting;
}

Expected<void> check_flange(const world::Robot& robot, const pinocchio::Model& model) {
  const std::string where = robot.urdf.string();
  if (robot.flange_link.empty()) return {};  // a base has none
  if (!model.existFrame(robot.flange_link, pinocchio::BODY)) {
    return fail(fmt::format("no link named '{}'", robot.flange_link), where,
                "name one of its links as robot.flange_link in world.yaml");
  }
  const auto parent = model.frames[model.getFrameId(robot.flange_link)].parentJoint;
  if (parent != static_cast<pinocchio::JointIndex>(model.njoints) - 1) {
    return fail(fmt::format("link '{}' does not hang on the last moving joint", robot.flange_link), where,
                "describe one chain of joints that ends in the flange");
  }
  return {};
}

// The first thing about `model` that this program cannot work with.
Expected<void> check(const world::Robot& robot, const pinocchio::Model& model) {
  const std::string where = robot.urdf.string();
  if (model.nv == 0)
    return fail("the robot has no moving joint", where, "give at least one joint type revolute or prismatic");
  if (model.nq != model.nv) {
    return fail("a joint is floating or spherical", where, "make it revolute, continuous or fixed");
  }
  if (model.nv > static_cast<int>(kMaxAxes)) {
    return fail(fmt::format("{} moving joints, at most {} are supported", model.nv, kMaxAxes), where,
                "fix some of them");
  }
  if (auto good = check_flange(robot, model); !good) return good;
  // Without it the controller would reckon with an arm that weighs nothing.
  for (pinocchio::JointIndex i = 1; i < static_cast<pinocchio::JointIndex>(model.njoints); ++i) {
    const auto& inertia = model.inertias[i];
    const Eigen::Matrix3d about_com = inertia.inertia().matrix();
    if (inertia.mass() > 0 && std::isfinite(inertia.mass()) && inertia.lever().allFinite() && about_com.allFinite() &&
        about_com.diagonal().minCoeff() > 0)
      continue;
    return fail(fmt::format("what moves with joint '{}' has no mass or no inertia", model.names[i]), where,
                "give its links an <inertial> with a mass and an inertia above 0");
  }
  for (const auto& capsule : robot.capsules) {
    if (!model.existFrame(capsule.link, pinocchio::BODY)) {
      return fail(fmt::format("a capsule hangs on '{}', which is no link", capsule.link), where,
                  "name one of its links in robot.capsules of world.yaml");
    }
  }
  const auto& limits = robot.limits;
  const std::pair<const char*, const AxisVector*> lists[] = {{"home", &robot.home},
                                                             {"position_min", &limits.position_min},
                                                             {"position_max", &limits.position_max},
                                                             {"speed", &limits.speed_rad_s},
                                                             {"acceleration", &limits.acceleration_rad_s2},
                                                             {"jerk", &limits.jerk_rad_s3},
                                                             {"torque", &limits.torque_nm},
                                                             {"rotor_inertia_kg_m2", &robot.rotor_inertia_kg_m2}};
  for (const auto& [name, list] : lists) {
    if (list->size() == model.nv) continue;
    return fail(fmt::format("'{}' has {} values, the URDF {} moving joints", name, list->size(), model.nv), robot.name,
                "give one value a moving joint");
  }
  return {};
}

}  // namespace

Expected<RobotModel> RobotModel::load(const world::Robot& robot) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(robot.urdf, ignored)) {
    return fail("no such URDF file", robot.urdf.string(), "correct the robot file's 'urdf'");
  }
  pinocchio::Model model;
  ParserMessages messages;
  try {
    pinocchio::urdf::buildModel(robot.urdf.string(), model);
  } catch (const std::exception& error) {
    return fail(fmt::format("broken URDF: {}", messages.first.empty() ? error.what() : messages.first),
                robot.urdf.string(), "mend the XML there");
  }
  model = counting_turns(model);
  if (auto checked = check(robot, model); !checked) return std::unexpected(checked.error());
  return RobotModel(std::make_unique<Impl>(robot, std::move(model)));
}

RobotModel RobotModel::copy() const {
  auto impl = std::make_unique<Impl>(*impl_);
  return RobotModel(std::move(impl));
}

int RobotModel::axes() const { return impl_->model.nv; }
const world::Robot& RobotModel::robot() const { return impl_->robot; }

Pose RobotModel::world_from_tip(const AxisVector& q) PONS_NONBLOCKING {
  impl_->place_links(q);
  return impl_->robot.world_from_base * pose_of(impl_->data.oMi[impl_->last_joint] * impl_->last_joint_from_tip);
}

Jacobian RobotModel::tip_jacobian(const AxisVector& q) PONS_NONBLOCKING { return impl_->tip_jacobian(q); }

Vector6 RobotModel::tip_acceleration(const AxisVector& q, const AxisVector& speed) PONS_NONBLOCKING {
  if (impl_->last_joint == 0) return Vector6::Zero();
  impl_->place_axes(q);
  const pinocchio::Data& data = impl_->data;
  // Of what hangs on the last joint: twist, and its rate, in base axes about the base's origin.
  pinocchio::Motion twist = pinocchio::Motion::Zero(), rate = twist;
  for (Eigen::Index axis = 0; axis < impl_->model.nv; ++axis) {
    const pinocchio::Motion turn(data.J.col(axis) * speed[axis]);
    rate += twist.cross(turn);
    twist += turn;
  }
  const Vector3 tip = (data.oMi[impl_->last_joint] * impl_->last_joint_from_tip).translation();
  const Vector3 velocity = twist.linear() + twist.angular().cross(tip);
  const Eigen::Matrix3d to_world = impl_->robot.world_from_base.linear();
  Vector6 acceleration;
  acceleration.head<3>() = to_world * (rate.linear() + rate.angular().cross(tip) + twist.angular().cross(velocity));
  acceleration.tail<3>() = to_world * rate.angular();
  return acceleration;
}

RobotModel::InverseMethod RobotModel::inverse_method() const {
  const auto& closed_form = impl_->inverse->closed_form();
  if (!closed_form) return InverseMethod::kIteration;
  return closed_form->structure() == ClosedForm::Structure::kThreeParallel ? InverseMethod::kThreeParallelAxes
                                                                           : InverseMethod::kSphericalWrist;
}

Expected<AxisVector> RobotModel::inverse(const Pose& world_from_tip, const AxisVector& seed, Among among) const {
  if (seed.size() != axes() || !seed.allFinite() || !world_from_tip.matrix().allFinite()) {
    return fail("pose or seed is not finite, or the seed has another number of axes", impl_->robot.name,
                fmt::format("give finite numbers, and {} of them as the seed", axes()));
  }
  if (const auto q = impl_->inverse->nearest(world_from_tip, seed, among)) return *q;
  return std::unexpected(impl_->unreached(world_from_tip, among));
}

void RobotModel::inverse_all(const Pose& world_from_tip, const AxisVector& seed, BranchSolutions& found) const {
  found.clear();
  if (seed.size() != axes() || !seed.allFinite() || !world_from_tip.matrix().allFinite()) return;
  impl_->inverse->all(world_from_tip, seed, found);
}

Branch RobotModel::branch(const AxisVector& q) const { return impl_->inverse->branch(q); }

const Chain& RobotModel::chain() const { return impl_->inverse->chain(); }

std::vector<std::string> RobotModel::axis_names() const {
  return {impl_->model.names.begin() + 1, impl_->model.names.end()};  // the first is the universe's
}

std::vector<RobotModel::Link> RobotModel::links() const {
  const auto& frames = impl_->model.frames;
  std::vector<Link> links;
  for (const auto& [frame, parent] : impl_->links)
    links.push_back({frames[frame].name, frames[parent].name, frames[frame].parentJoint == frames[parent].parentJoint});
  return links;
}

void RobotModel::place_links(const AxisVector& q, std::vector<Pose>& parent_from_link) {
  impl_->place_links(q);
  parent_from_link.clear();
  const auto base_from = [&](pinocchio::FrameIndex index) {
    const auto& frame = impl_->model.frames[index];
    return impl_->data.oMi[frame.parentJoint] * frame.placement;
  };
  for (const auto& [frame, parent] : impl_->links)
    parent_from_link.push_back(pose_of(base_from(parent).actInv(base_from(frame))));
}

std::vector<int> RobotModel::capsule_axes() const {
  std::vector<int> axes;
  for (const pinocchio::FrameIndex frame : impl_->capsule_frames) {
    axes.push_back(static_cast<int>(impl_->model.frames[frame].parentJoint));  // joint 0 is the world
  }
  return axes;
}

void RobotModel::place_capsules(const AxisVector& q, std::vector<PlacedCapsule>& capsules) {
  impl_->place_links(q);
  capsules.clear();
  for (std::size_t i = 0; i < impl_->robot.capsules.size(); ++i) {
    const auto& capsule = impl_->robot.capsules[i];
    const auto& frame = impl_->model.frames[impl_->capsule_frames[i]];
    const Pose world_from_link =
        impl_->robot.world_from_base * pose_of(impl_->data.oMi[frame.parentJoint] * frame.placement);
    capsules.push_back({world_from_link * capsule.from, world_from_link * capsule.to, capsule.radius_m});
  }
}

void RobotModel::inverse_dynamics(const AxisVector& q, const AxisVector& speed, const AxisVector& acceleration,
                                  const Payload& payload, AxisVector& torque_nm) PONS_NONBLOCKING {
  impl_->carry(payload);
  impl_->q = q;
  impl_->v = speed;
  impl_->a = acceleration;
  torque_nm = pinocchio::rnea(impl_->model, impl_->data, impl_->q, impl_->v, impl_->a);
}

void RobotModel::forward_dynamics(const AxisVector& q, const AxisVector& speed, const AxisVector& torque_nm,
                                  const Payload& payload, AxisVector& acceleration) PONS_NONBLOCKING {
  impl_->carry(payload);
  impl_->q = q;
  impl_->v = speed;
  // Pinocchio's articulated-body algorithm costs a minute of compiling; for eight axes this is as good.
  impl_->a.setZero();
  const AxisVector bias = pinocchio::rnea(impl_->model, impl_->data, impl_->q, impl_->v, impl_->a);
  AxisMatrix mass(axes(), axes());
  for (int axis = 0; axis < axes(); ++axis) {
    impl_->a.setZero();
    impl_->a[axis] = 1;
    mass.col(axis) = pinocchio::rnea(impl_->model, impl_->data, impl_->q, impl_->v, impl_->a) - bias;
  }
  acceleration = mass.ldlt().solve(torque_nm - bias);
}

void RobotModel::momentum(const AxisVector& q, const AxisVector& speed, const Payload& payload,
                          AxisVector& momentum_nms, AxisVector& rate_nm) PONS_NONBLOCKING {
  const pinocchio::Model& model = impl_->model;
  pinocchio::Data& data = impl_->data;
  impl_->carry(payload);
  impl_->place_axes(q);
  // Of each body and all beyond it, in base axes about the base's origin: momentum, and weight.
  std::array<pinocchio::Force, kMaxAxes + 1> beyond, weight;
  std::array<pinocchio::Motion, kMaxAxes + 1> twist;
  const auto count = static_cast<std::size_t>(model.njoints);
  twist[0].setZero();
  for (std::size_t joint = 1; joint < count; ++joint) {
    const auto axis = static_cast<Eigen::Index>(joint) - 1;
    twist[joint] = twist[model.parents[joint]];
    twist[joint].toVector() += data.J.col(axis) * speed[axis];
    const pinocchio::SE3& base_from_body = data.oMi[joint];
    const pinocchio::Inertia& inertia = model.inertias[joint];
    beyond[joint] = base_from_body.act(inertia * base_from_body.actInv(twist[joint]));
    weight[joint] = base_from_body.act(inertia * base_from_body.actInv(model.gravity));
  }
  momentum_nms.resize(model.nv);
  rate_nm.resize(model.nv);
  for (std::size_t joint = count - 1; joint > 0; --joint) {
    const auto axis = static_cast<Eigen::Index>(joint) - 1;
    const pinocchio::Motion screw(data.J.col(axis));
    momentum_nms[axis] = screw.toVector().dot(beyond[joint].toVector()) + model.armature[axis] * speed[axis];
    // Turning the joint moves what lies beyond under the speed that comes from before it.
    rate_nm[axis] = twist[joint].cross(screw).toVector().dot(beyond[joint].toVector()) +
                    screw.toVector().dot(weight[joint].toVector());
    const std::size_t parent = model.parents[joint];
    if (parent == 0) continue;
    beyond[parent] += beyond[joint];
    weight[parent] += weight[joint];
  }
}

void RobotModel::mass_matrix(const AxisVector& q, const Payload& payload, AxisMatrix& mass) PONS_NONBLOCKING {
  impl_->carry(payload);
  impl_->q = q;
  impl_->forget();  // it keeps its own in the same places
  // The type for which Pinocchio's library holds this function: any other costs a minute of compiling.
  pinocchio::crba(impl_->model, impl_->data, Eigen::Ref<const Eigen::VectorXd>(impl_->q));
  mass = impl_->data.M.selfadjointView<Eigen::Upper>();
}

}  // namespace pons::model
