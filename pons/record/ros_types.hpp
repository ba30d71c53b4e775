// Which of the types that Pons knows a recording's channel holds. Any thread.
#pragma once

#include <string_view>

#include "pons/core/error.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/wire/known_types.hpp"

namespace pons::record {

// Whether messages of both have the same bytes and the same names of fields; `a` and `b` are "ros2msg" texts of `type`.
// Comments, constants, defaults and bounds do not count.
[[nodiscard]] bool same_layout(std::string_view type, std::string_view a, std::string_view b);

// Errors: its messages are no CDR; Pons knows no type of that name; it is another version of it.
[[nodiscard]] Expected<const wire::KnownType*> known_type_of(const Contents& contents, const mcap::Channel& channel);

}  // namespace pons::record
