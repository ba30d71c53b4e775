// The node's parameters, as ROS 2's tools list, read and set them (rcl_interfaces). Everything happens on the node's
// thread, but that any may ask what a number is now.
#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/gate.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_descriptor.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_event.hpp"
#include "pons/wire/types/rcl_interfaces/msg/set_parameters_result.hpp"

namespace pons::apps {

class RosParameters {
 public:
  using Descriptor = wire::rcl_interfaces::msg::ParameterDescriptor;
  using Event = wire::rcl_interfaces::msg::ParameterEvent;
  using Parameter = wire::rcl_interfaces::msg::Parameter;
  using Result = wire::rcl_interfaces::msg::SetParametersResult;
  using Value = wire::rcl_interfaces::msg::ParameterValue;

  // `gate` outlives it, and has not been started.
  explicit RosParameters(gate::ros::Gate& gate) : gate_(gate) {}

  // ---- before start() ----

  // What tells of the run and cannot be set.
  void add(std::string name, std::string description, Value value);
  // A number from `least` to `most` that may be set; what it is now, any thread may ask. It lives as long as this.
  [[nodiscard]] const std::atomic<double>& add(std::string name, std::string description, double value, double least,
                                               double most);
  // After them. Errors: those of serve() and Node::advertise().
  [[nodiscard]] Expected<void> serve();

 private:
  struct One {
    Descriptor descriptor;
    Value value;
    std::atomic<double> number{0};  // of one that may be set
  };
  [[nodiscard]] Expected<void> serve_looks();
  [[nodiscard]] Expected<void> serve_changes();
  [[nodiscard]] One* find(std::string_view name);
  // Nothing: it may be set so.
  [[nodiscard]] std::optional<std::string> objection(const Parameter& parameter);
  void set(const std::vector<Parameter>& parameters);
  [[nodiscard]] Result set_all(const std::vector<Parameter>& parameters);

  gate::ros::Gate& gate_;
  std::deque<One> all_;
  std::optional<gate::ros::Publisher<Event>> events_;
};

[[nodiscard]] RosParameters::Value parameter_value(bool value);
[[nodiscard]] RosParameters::Value parameter_value(double value);
[[nodiscard]] RosParameters::Value parameter_value(std::string_view value);
RosParameters::Value parameter_value(const char* value) = delete;  // it would be taken for a bool

}  // namespace pons::apps
