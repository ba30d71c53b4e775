// What a recording keeps beside its messages, so that programs that know nothing of Pons can read them: a type's
// definition and those of all that it refers to, in MCAP's "ros2msg" form (mcap.dev/spec/registry). Any thread.
#pragma once

#include <string>
#include <string_view>

#include "pons/wire/cdr.hpp"

namespace pons::wire {

// "rmw_dds_common_humble/msg/Gid" is "rmw_dds_common/msg/Gid" to everybody else: of a package that has two forms, one
// has a name of its own here (docs/decisions/0043-types-from-interface-files.md).
[[nodiscard]] std::string wire_name(std::string_view type);

// Of a type that tools/ros_codecs made, by the name that it has here; put together anew each time. Empty: there is no
// such type.
[[nodiscard]] std::string ros2msg_schema(std::string_view type);

// What its interface file says of it alone, likewise.
[[nodiscard]] std::string_view definition(std::string_view type);

template <Message T>
[[nodiscard]] std::string ros2msg_schema() {
  return ros2msg_schema(T::kName);
}

}  // namespace pons::wire
