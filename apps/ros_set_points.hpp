// The dialect `set_points`: where the joints of an arm shall be, again and again, as a brain with no more to say of
// motion sends it. What the loop is asked for meanwhile, views/set_points_view.hpp shows. On the node's thread.
#pragma once

#include <optional>

#include "apps/ros_by_hand.hpp"
#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/std_msgs/msg/float64_multi_array.hpp"
#include "pons/world/dialect.hpp"

namespace pons::apps {

class RosSetPoints {
 public:
  using Float64MultiArray = wire::std_msgs::msg::Float64MultiArray;
  // `gate` outlives it, and has not been started.
  explicit RosSetPoints(gate::ros::Gate& gate) : gate_(gate) {}
  // Errors: those of the topic, with its place in the world's file.
  [[nodiscard]] Expected<void> serve(const world::Dialect& spec);

 private:
  void take(const Float64MultiArray& set_point);

  gate::ros::Gate& gate_;
  std::optional<RosByHand> wishes_;  // once it is served
};

}  // namespace pons::apps
