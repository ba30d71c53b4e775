// Whether a robot, with its tool and what it carries, touches itself or boxes around it. Distances by coal.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/model/robot_model.hpp"

namespace pons::model {

struct Box {
  Pose world_from_box = Pose::Identity();  // of its middle
  Vector3 size_m = Vector3::Zero();        // along its own axes
};

// What the tool holds, rigid to it.
struct CarriedBox {
  Pose tip_from_box = Pose::Identity();
  Vector3 size_m = Vector3::Zero();
};

// How far everything keeps apart at least.
struct CollisionMargins {
  double scene_m = 0;              // robot and load from the boxes
  std::optional<double> self_m{};  // links from one another; without it that is not judged,
  std::optional<double> load_m{};  // and the load from the links likewise
};

// Bodies are what joints part: body 0 stands still, body k moves with axes 1 to k. A body's shape is its capsules of
// the robot file; the load belongs to the last one. Two bodies are held apart unless one joint joins them (its limits
// do that), or two of their capsules touch at every one of kProbes random postures (then that is how coarse capsules
// are, and only those two are left out).
//
// It holds a robot model and a scratch pad, so one object serves one thread. Not for the control loop: it allocates.
class CollisionModel {
 public:
  static constexpr int kProbes = 400;
  // Two postures are this near one another, in travel of any point of the robot, when nothing between them is looked
  // at.
  static constexpr double kStep_m = 0.01;

  CollisionModel(RobotModel model, const CollisionMargins& margins);
  CollisionModel(CollisionModel&&) noexcept;
  CollisionModel& operator=(CollisionModel&&) noexcept;
  ~CollisionModel();

  // Boxes wholly inside one another are fine. They replace those from before.
  void surround(std::span<const Box> boxes);
  void carry(const std::optional<CarriedBox>& load);

  // Whether the arm at rest at q (rad) keeps all margins.
  [[nodiscard]] bool clear(const AxisVector& q);
  // Whether it keeps them on the straight line in joint space from a to b: with certainty all but kStep_m / 2 of them.
  // No point of a body moves farther than Σ |Δq| · reach over the axes that move it, so where the distances at both
  // ends add up to more than that, nothing between them can touch; elsewhere the line is halved, down to kStep_m
  // (Schwarzer, Saha and Latombe, "Exact collision checking of robot paths", 2004).
  [[nodiscard]] bool clear(const AxisVector& a, const AxisVector& b);
  // What it was that did not keep its margin at q: "forearm_link and box 3"; empty where all is clear.
  [[nodiscard]] std::string touching(const AxisVector& q);

  // The least distance beyond its margin of any pair, m; never more than kFar_m. Not above zero: some margin is not
  // kept.
  static constexpr double kFar_m = 0.5;
  [[nodiscard]] double clearance(const AxisVector& q);
  // How far any point of the robot moves at most on the straight line from a to b, m.
  [[nodiscard]] double travel(const AxisVector& a, const AxisVector& b) const;
  // Capsules of different bodies that touch at every posture, by number.
  [[nodiscard]] const std::vector<std::pair<std::size_t, std::size_t>>& left_out() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pons::model
