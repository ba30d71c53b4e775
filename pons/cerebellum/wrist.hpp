// What the wrist feels, less what tool and load do to it by themselves: by its sensor, or, of an arm without one, by
// what its drives' torques tell.
#pragma once

#include <cmath>

#include "pons/body/body.hpp"
#include "pons/core/axes.hpp"
#include "pons/core/realtime.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::cerebellum {

// What tool and payload exert on the flange in this motion by weight and inertia, as points of mass: force (N), moment
// about the flange (N·m), flange axes (Newton and Euler).
[[nodiscard]] Vector6 carried_wrench(model::RobotModel& model, const AxisState& motion,
                                     const model::Payload& payload) PONS_NONBLOCKING;

// What the tip feels by the wrist's sensor: less the weight and inertia of tool and payload in the motion that is
// commanded, and less the sensor's bias, which is what remains on average while nothing is touched. The arm need not
// rest for that. The loop's thread.
class WristSense {
 public:
  explicit WristSense(double bias_s) : bias_s_(bias_s) {}
  enum class Bias { kLearn, kKeep };
  void feel(model::RobotModel& model, const AxisState& motion, const model::Payload& payload,
            const body::Sensors& sensors, Bias bias, double dt_s) PONS_NONBLOCKING;
  // Without a sensor: `wrench` is what explains the axes' external torques (tip_wrench(), world axes). What it says of
  // an arm that touches nothing, by a model that is not quite right, is its bias.
  void infer(const Vector6& wrench, const Eigen::Matrix3d& world_from_tip, Bias bias, double dt_s) PONS_NONBLOCKING;
  // On the tip from outside: force (N), moment about the tip (N·m), tip axes.
  [[nodiscard]] const Vector6& at_tip() const { return at_tip_; }

 private:
  void learn(const Vector6& rest, Bias bias, double dt_s) {
    if (bias == Bias::kLearn) bias_ += (1 - std::exp(-dt_s / bias_s_)) * (rest - bias_);
  }

  double bias_s_;
  Vector6 bias_ = Vector6::Zero(), at_tip_ = Vector6::Zero();
};

}  // namespace pons::cerebellum
