// What the attributes of a node say, beside its ports.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "pons/bridge/tree/program.hpp"
#include "pons/bridge/tree/value.hpp"

namespace pons::bridge::tree {

// The scripts before and after a node.
struct ConditionName {
  std::string_view name;
  std::int32_t Conditions::* script;
};
[[nodiscard]] std::span<const ConditionName> condition_names();

// An attribute that begins with an underscore and means nothing to whoever runs a tree. BehaviorTree.CPP passes over
// it, whatever it is.
struct Stray {
  std::string_view meant;  // which name it was meant to be, so near are they; empty: something else altogether
  enum class Is : std::uint8_t { kRemark, kMistake } is = Is::kRemark;  // a mistake can hardly be anything else
};
// Nothing: of that name there is one, or Groot2 and BehaviorTree.CPP write it themselves.
[[nodiscard]] std::optional<Stray> stray_attribute(std::string_view name);

// The name in "{name}"; empty when it is none, but an object in JSON, say. "{=}" is the port's own.
[[nodiscard]] std::string_view entry_in(std::string_view text, std::string_view port);

// "SUCCESS" and so on, as the number that it is to scripts and ports.
[[nodiscard]] std::optional<Value> status_of(std::string_view text);

}  // namespace pons::bridge::tree
