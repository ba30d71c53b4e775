// Types by name, for what has only the name: a recording's channels, a world's file. Here those that Pons was built
// with; others: pons/wire/interface_types.hpp. Any thread.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/wire/json.hpp"

namespace pons::wire {

struct KnownType {
  std::string name;  // as it is here: "rmw_dds_common_humble/msg/Gid"
  std::string hash;  // RIHS01
  // Errors: those of decode().
  std::function<Expected<Json>(std::span<const std::byte> cdr)> to_json;
  // Errors: those of from_json() and encode().
  std::function<Expected<std::vector<std::byte>>(const Json& json)> to_cdr;
  // A new message: its fields, and what they hold when nobody says otherwise.
  std::function<Json()> empty;
};

// Those that have this name on the wire: none, one, or two forms of it.
[[nodiscard]] std::vector<const KnownType*> known_types(std::string_view wire_name);
// The one that has this name here; nullptr: there is none.
[[nodiscard]] const KnownType* known_type(std::string_view name);

}  // namespace pons::wire
