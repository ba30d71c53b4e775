#include "pons/gate/ros/names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::gate::ros {
namespace {

constexpr std::uint32_t kDomainsMost = 232;
constexpr std::string_view kDdsPart = "::dds_::";
constexpr std::string_view kFormOnly = "_humble";
constexpr std::array<std::string_view, 2> kOtherForms{"nav2_msgs_humble", "rmw_dds_common_humble"};  // ros2/interfaces
// In characters, as rmw has them (rmw/validate_node_name.h, validate_namespace.h, validate_full_topic_name.h).
constexpr std::size_t kNodeNameMost = 255, kSpaceMost = 245, kNameMost = 247;
constexpr std::array<std::pair<Use, std::string_view>, 3> kPrefixes{
    {{Use::kTopic, "rt"}, {Use::kRequest, "rq"}, {Use::kReply, "rr"}}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_of_token(char c) { return is_digit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_token(std::string_view text) {
  return !text.empty() && !is_digit(text.front()) && std::ranges::all_of(text, is_of_token);
}

// "/a/b"; not "/".
bool is_absolute(std::string_view name) {
  while (!name.empty()) {
    if (name.front() != '/') return false;
    name.remove_prefix(1);
    const std::size_t end = std::min(name.find('/'), name.size());
    if (!is_token(name.substr(0, end))) return false;
    name.remove_prefix(end);
    if (name.empty()) return true;
  }
  return false;
}

std::unexpected<Error> no_name(std::string_view text) {
  return fail(fmt::format("'{}' is no name", text), "ROS 2 name",
              "parts of letters, digits and underscores that begin with no digit, divided by single slashes");
}

// What no node of ROS 2 can be called, or ask for.
std::unexpected<Error> too_long(std::string_view text, std::size_t most) {
  constexpr std::size_t kShown = 300;
  return fail(fmt::format("'{}' has {} characters", task::excerpt(text, kShown), text.size()), "ROS 2 name",
              fmt::format("{} are the most: shorten it, or the names that it is made of", most));
}

// "{node}" and the like replaced; empty: an unknown one.
std::string substituted(std::string_view text, const NodeName& node) {
  std::string result;
  while (!text.empty()) {
    const std::size_t open = std::min(text.find('{'), text.size());
    result += text.substr(0, open);
    text.remove_prefix(open);
    if (text.empty()) break;
    const std::size_t close = text.find('}');
    if (close == std::string_view::npos) return "";
    const std::string_view inside = text.substr(1, close - 1);
    if (inside == "node") {
      result += node.name;
    } else if (inside == "ns" || inside == "namespace") {
      result += node.space == "/" ? "" : node.space;
    } else {
      return "";
    }
    text.remove_prefix(close + 1);
  }
  return result;
}

std::string under(std::string_view space, std::string_view name) {
  return fmt::format("{}/{}", space == "/" ? "" : space, name);
}

}  // namespace

std::string NodeName::full() const { return under(space, name); }

Expected<NodeName> node_name(std::string space, std::string name) {
  if (space.empty()) space.push_back('/');
  if (space != "/" && !is_absolute(space)) return no_name(space);
  if (!is_token(name)) return no_name(name);
  if (space.size() > kSpaceMost) return too_long(space, kSpaceMost);
  if (name.size() > kNodeNameMost) return too_long(name, kNodeNameMost);
  return NodeName{std::move(space), std::move(name)};
}

Expected<std::string> expanded(std::string_view name, const NodeName& node, const Remaps& remaps) {
  std::string full = substituted(name, node);
  if (full == "~") {
    full = node.full();
  } else if (full.starts_with("~/")) {
    full = under(node.full(), std::string_view(full).substr(2));
  } else if (!full.starts_with('/')) {
    full = under(node.space, full);
  }
  if (!is_absolute(full)) return no_name(name);
  if (const auto whole = remaps.find(full); whole != remaps.end()) return whole->second;  // looked at by add_remap()
  const std::size_t action_end = std::min(full.find(kActionPart), full.size());
  if (const auto action = remaps.find(std::string_view(full).substr(0, action_end)); action != remaps.end())
    full.replace(0, action_end, action->second);
  if (full.size() > kNameMost) return too_long(full, kNameMost);
  return full;
}

Expected<void> add_remap(std::string_view rule, const NodeName& node, Remaps& remaps) {
  const std::size_t middle = rule.find(":=");
  if (middle == std::string_view::npos)
    return fail(fmt::format("'{}' is no remapping", rule), "ROS 2 remapping", "write FROM:=TO, as in scan:=/left/scan");
  auto from = expanded(rule.substr(0, middle), node, {});
  if (!from) return std::unexpected(from.error());
  auto to = expanded(rule.substr(middle + 2), node, {});
  if (!to) return std::unexpected(to.error());
  if (!remaps.emplace(*from, *std::move(to)).second)
    return fail(fmt::format("'{}' is remapped twice", *from), "ROS 2 remapping", "leave one rule for each name");
  return {};
}

std::string wire_topic(std::string_view name, Use use) {
  const auto prefix = std::ranges::find(kPrefixes, use, &std::pair<Use, std::string_view>::first)->second;
  const std::string_view ending = use == Use::kRequest ? "Request" : use == Use::kReply ? "Reply" : "";
  return fmt::format("{}{}{}", prefix, name, ending);
}

std::string wire_type(std::string_view type) {
  const std::size_t package_end = type.find('/');
  const std::size_t kind_end = type.find('/', package_end + 1);
  std::string_view package = type.substr(0, package_end);
  if (std::ranges::find(kOtherForms, package) != kOtherForms.end()) package.remove_suffix(kFormOnly.size());
  return fmt::format("{}::{}{}{}_", package, type.substr(package_end + 1, kind_end - package_end - 1), kDdsPart,
                     type.substr(kind_end + 1));
}

RosName ros_name(std::string_view wire_topic) {
  for (const auto& [use, prefix] : kPrefixes) {
    if (!wire_topic.starts_with(prefix) || wire_topic.substr(prefix.size(), 1) != "/") continue;
    std::string_view name = wire_topic.substr(prefix.size());
    const std::string_view ending = use == Use::kRequest ? "Request" : use == Use::kReply ? "Reply" : "";
    if (!name.ends_with(ending)) return {};
    name.remove_suffix(ending.size());
    return {std::string(name), use};
  }
  return {};
}

std::string ros_type(std::string_view wire_type) {
  const std::size_t part = wire_type.find(kDdsPart);
  if (part == std::string_view::npos || !wire_type.ends_with('_')) return "";
  const std::string_view spaces = wire_type.substr(0, part);
  std::string_view name = wire_type.substr(part + kDdsPart.size());
  name.remove_suffix(1);
  const std::size_t colons = spaces.find("::");
  if (colons == std::string_view::npos) return "";
  return fmt::format("{}/{}/{}", spaces.substr(0, colons), spaces.substr(colons + 2), name);
}

Expected<std::uint32_t> domain_id(std::string_view text) {
  std::uint32_t id = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (problem != std::errc{} || end != text.data() + text.size() || id > kDomainsMost)
    return fail(fmt::format("'{}' is no domain", text), "ROS_DOMAIN_ID",
                fmt::format("a number from 0 to {}", kDomainsMost));
  return id;
}

std::string_view value_of(std::string_view user_data, std::string_view key) {
  while (!user_data.empty()) {
    const std::string_view pair = user_data.substr(0, user_data.find(';'));
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos && pair.substr(0, equals) == key) return pair.substr(equals + 1);
    user_data.remove_prefix(std::min(pair.size() + 1, user_data.size()));
  }
  return {};
}

}  // namespace pons::gate::ros
