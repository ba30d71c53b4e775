// The dialect `set_points`: where the joints of an arm shall be, again and again, as a brain with no more to say of
// motion sends it. What the loop is asked for meanwhile, views/set_points_view.hpp shows. On the node's thread.
#pragma once

#include <string>

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
  // Said once, until it is another thing or all is well again: they come again and again.
  void refuse(const std::string& why);

  gate::ros::Gate& gate_;
  std::string topic_;
  std::string refused_;
};

}  // namespace pons::apps
