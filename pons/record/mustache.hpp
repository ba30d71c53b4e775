// Text from a template and a JSON value, after Mustache (mustache(5)), of which it knows what pages need:
//
//   {{name}}, {{.}}            the value, escaped for HTML: there is no way around the escaping
//   {{#name}} … {{/name}}      once for each element of a list; once for an object, which names are then looked up in
//                              first, and for a text or number that is neither empty nor 0; not for false, null, [], ""
//   {{^name}} … {{/name}}      where {{#name}} would leave nothing
//   {{! words }}               nothing
//
// A tag of sections or words alone on its line takes the line with it. Names are looked up from the innermost value
// outwards; a.b looks for b in what a is.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"

namespace pons::record {

// Errors, by the template's line: a name that the view does not have (null is a value), a section that is not closed or
// not open, a tag without its end, a value that is a list or an object.
[[nodiscard]] Expected<std::string> render(std::string_view text, const nlohmann::ordered_json& view);

}  // namespace pons::record
