// The nodes of BehaviorTree.CPP 4: their names, how many children they have, and their ports.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "pons/bridge/tree/program.hpp"

namespace pons::bridge::tree {

struct PortType {
  enum class Of : std::uint8_t {
    kInteger,  // a constant or {entry}; so, too:
    kUnsigned,
    kText,
    kValue,
    kQueue,    // values apart by ';'
    kBoolean,  // a constant only; so, too:
    kStatus,   // SUCCESS, FAILURE, SKIPPED
    kScript,
    kKey,  // the name of an entry, in braces or not
    kOut,  // {entry}
  };
  std::string_view name;
  Of of = Of::kText;
  std::string_view standard = {};  // where none is given
  enum class Need : std::uint8_t { kMust, kMay } need = Need::kMust;
};

struct KindInfo {
  std::string_view name;
  Kind kind = Kind::kSequence;
  std::int32_t fewest_children = 0, most_children = 0;
  std::span<const PortType> ports = {};
  Loop::Of loop = Loop::Of::kText;
};

// What it is given is a time, in ms.
[[nodiscard]] constexpr bool waits(Kind kind) {
  return kind == Kind::kTimeout || kind == Kind::kDelay || kind == Kind::kSleep;
}
// nullptr: no such node.
[[nodiscard]] const KindInfo* find_kind(std::string_view name);
[[nodiscard]] std::span<const KindInfo> all_kinds();
// Why Pons has not a node that BehaviorTree.CPP has or had; empty when it never had it.
[[nodiscard]] std::string_view why_not(std::string_view name);

}  // namespace pons::bridge::tree
