#include "apps/ros_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pons/gate/ros/action.hpp"
#include "pons/gate/ros/service.hpp"
#include "pons/wire/types/rcl_interfaces/msg/parameter_type.hpp"
#include "pons/wire/types/rcl_interfaces/srv/describe_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/get_parameter_types.hpp"
#include "pons/wire/types/rcl_interfaces/srv/get_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/list_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/set_parameters.hpp"
#include "pons/wire/types/rcl_interfaces/srv/set_parameters_atomically.hpp"

namespace pons::apps {
namespace {

using gate::ros::Answer;
using wire::rcl_interfaces::msg::ParameterType;
using wire::rcl_interfaces::srv::DescribeParameters;
using wire::rcl_interfaces::srv::GetParameters;
using wire::rcl_interfaces::srv::GetParameterTypes;
using wire::rcl_interfaces::srv::ListParameters;
using wire::rcl_interfaces::srv::SetParameters;
using wire::rcl_interfaces::srv::SetParametersAtomically;

// Names that a request may have: more than there are parameters, with room for who asks twice.
constexpr std::size_t kNamesMost = 256;

// What a request asks about, no more of it than is reasonable.
template <typename Each>
std::span<const Each> first_of(const std::vector<Each>& all) {
  return std::span(all).first(std::min(all.size(), kNamesMost));
}

// A prefix means itself and what stands under it, after a point.
bool is_under(std::string_view name, std::string_view prefix) {
  return name == prefix || (name.starts_with(prefix) && name.substr(prefix.size()).starts_with('.'));
}

}  // namespace

RosParameters::Value parameter_value(bool value) {
  return {.type = ParameterType::PARAMETER_BOOL, .bool_value = value};
}

RosParameters::Value parameter_value(double value) {
  return {.type = ParameterType::PARAMETER_DOUBLE, .double_value = value};
}

RosParameters::Value parameter_value(std::string_view value) {
  return {.type = ParameterType::PARAMETER_STRING, .string_value = std::string(value)};
}

void RosParameters::add(std::string name, std::string description, Value value) {
  One& one = all_.emplace_back();
  one.descriptor = {
      .name = std::move(name), .type = value.type, .description = std::move(description), .read_only = true};
  one.value = std::move(value);
}

const std::atomic<double>& RosParameters::add(std::string name, std::string description, double value, double least,
                                              double most) {
  One& one = all_.emplace_back();
  one.value = parameter_value(value);
  one.number = value;
  one.descriptor = {.name = std::move(name), .type = one.value.type, .description = std::move(description)};
  one.descriptor.floating_point_range.push_back({.from_value = least, .to_value = most});
  return one.number;
}

RosParameters::One* RosParameters::find(std::string_view name) {
  const auto found =
      std::ranges::find(all_, name, [](const One& one) { return std::string_view(one.descriptor.name); });
  return found == all_.end() ? nullptr : &*found;
}

Expected<void> RosParameters::serve() {
  if (auto served = serve_looks(); !served) return served;
  if (auto served = serve_changes(); !served) return served;
  auto events = gate_.node().advertise<Event>("/parameter_events", gate::ros::kParametersQos);
  if (!events) return std::unexpected(events.error());
  events_.emplace(*std::move(events));
  return {};
}

Expected<void> RosParameters::serve_looks() {
  auto served = gate::ros::serve<ListParameters>(
      gate_.node(), "~/list_parameters",
      [this](const ListParameters::Request& request, const Answer<ListParameters>& answer) {
        ListParameters::Response response;
        const auto prefixes = first_of(request.prefixes);
        for (const One& one : all_) {
          const std::string& name = one.descriptor.name;
          if (prefixes.empty() || std::ranges::any_of(prefixes, [&](const auto& each) { return is_under(name, each); }))
            response.result.names.push_back(name);
        }
        answer(response);
      });
  if (!served) return served;
  served = gate::ros::serve<GetParameters>(
      gate_.node(), "~/get_parameters",
      [this](const GetParameters::Request& request, const Answer<GetParameters>& answer) {
        GetParameters::Response response;
        for (const std::string& name : first_of(request.names)) {
          const One* const one = find(name);
          response.values.push_back(one == nullptr ? Value{} : one->value);
        }
        answer(response);
      });
  if (!served) return served;
  served = gate::ros::serve<GetParameterTypes>(
      gate_.node(), "~/get_parameter_types",
      [this](const GetParameterTypes::Request& request, const Answer<GetParameterTypes>& answer) {
        GetParameterTypes::Response response;
        for (const std::string& name : first_of(request.names)) {
          const One* const one = find(name);
          response.types.push_back(one == nullptr ? ParameterType::PARAMETER_NOT_SET : one->value.type);
        }
        answer(response);
      });
  if (!served) return served;
  return gate::ros::serve<DescribeParameters>(
      gate_.node(), "~/describe_parameters",
      [this](const DescribeParameters::Request& request, const Answer<DescribeParameters>& answer) {
        DescribeParameters::Response response;
        for (const std::string& name : first_of(request.names)) {
          const One* const one = find(name);
          response.descriptors.push_back(one == nullptr ? Descriptor{.name = name} : one->descriptor);
        }
        answer(response);
      });
}

Expected<void> RosParameters::serve_changes() {
  auto served = gate::ros::serve<SetParameters>(
      gate_.node(), "~/set_parameters",
      [this](const SetParameters::Request& request, const Answer<SetParameters>& answer) {
        SetParameters::Response response;
        for (const Parameter& each : first_of(request.parameters)) response.results.push_back(set_all({each}));
        answer(response);
      });
  if (!served) return served;
  return gate::ros::serve<SetParametersAtomically>(
      gate_.node(), "~/set_parameters_atomically",
      [this](const SetParametersAtomically::Request& request, const Answer<SetParametersAtomically>& answer) {
        if (request.parameters.size() > kNamesMost)
          return answer({.result = {.successful = false, .reason = "more parameters than there are"}});
        answer({.result = set_all(request.parameters)});
      });
}

std::optional<std::string> RosParameters::objection(const Parameter& parameter) {
  const One* const one = find(parameter.name);
  if (one == nullptr) return fmt::format("there is no parameter '{}': list_parameters tells of all", parameter.name);
  const Descriptor& known = one->descriptor;
  if (known.read_only) return fmt::format("{} tells of the run and cannot be set", known.name);
  if (parameter.value.type != known.type) return fmt::format("{} is a double: write it with a point, 10.0", known.name);
  const auto& range = known.floating_point_range.at(0);
  const double value = parameter.value.double_value;
  if (!std::isfinite(value) || value < range.from_value || value > range.to_value)
    return fmt::format("{} is {}; it may be {} to {}", known.name, value, range.from_value, range.to_value);
  return std::nullopt;
}

// All or none.
RosParameters::Result RosParameters::set_all(const std::vector<Parameter>& parameters) {
  for (const Parameter& each : parameters) {
    if (const auto why = objection(each)) return {.successful = false, .reason = *why};
  }
  set(parameters);
  return {.successful = true};
}

void RosParameters::set(const std::vector<Parameter>& parameters) {
  Event event{.stamp = gate::ros::ros_stamp(gate_.node().stamp_ns()), .node = gate_.node().name().full()};
  for (const Parameter& each : parameters) {
    One& one = *find(each.name);
    one.value.double_value = each.value.double_value;
    one.number = each.value.double_value;
    event.changed_parameters.push_back({.name = each.name, .value = one.value});
  }
  if (event.changed_parameters.empty()) return;
  if (const auto told = events_->publish(event); !told) gate_.node().warn(told.error().line());
}

}  // namespace pons::apps
