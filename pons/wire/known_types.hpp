// All types that Pons knows, by name, for what has only the name: a recording's channels, a
// world's file. Any thread.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/wire/json.hpp"

namespace pons::wire {

struct KnownType {
  std::string_view name;  // as it is here: "rmw_dds_common_humble/msg/Gid"
  std::string_view hash;  // RIHS01
  // Errors: those of decode().
  Expected<Json> (*to_json)(std::span<const std::byte> cdr);
  // Errors: those of from_json() and encode().
  Expected<std::vector<std::byte>> (*to_cdr)(const Json& json);
  // A new message: its fields, and what they hold when nobody says otherwise.
  Json (*empty)();
};

// Those that have this name on the wire: none, one, or two forms of it.
[[nodiscard]] std::vector<const KnownType*> known_types(std::string_view wire_name);
// The one that has this name here; nullptr: there is none.
[[nodiscard]] const KnownType* known_type(std::string_view name);

}  // namespace pons::wire
