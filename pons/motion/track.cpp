#include "pons/motion/track.hpp"

#include "pons/model/iterate.hpp"

namespace pons::motion {
namespace {

constexpr int kNewtonSteps = 8;
constexpr double kExact = 1e-11;  // m and rad, together

}  // namespace

Expected<AxisVector> angles_near(const model::RobotModel& model, const Pose& world_from_tip, const AxisVector& near) {
  if (model.inverse_method() != model::RobotModel::InverseMethod::kIteration)
    return model.inverse(world_from_tip, near);
  const model::Chain& chain = model.chain();
  const AxisLimits& limits = chain.limits();
  AxisVector q = near;
  Pose tip;
  model::Jacobian jacobian;
  for (int i = 0; i < kNewtonSteps; ++i) {
    chain.evaluate(q, tip, jacobian);
    const model::PoseError error = model::pose_error(world_from_tip, tip);
    if (error.norm() < kExact) {
      const bool inside =
          (q.array() >= limits.position_min.array()).all() && (q.array() <= limits.position_max.array()).all();
      return inside ? Expected<AxisVector>(q) : fail("beyond a position limit");
    }
    q += model::damped_step(jacobian, error, 0);
    if (!q.allFinite()) break;
  }
  return fail("out of reach");
}

}  // namespace pons::motion
