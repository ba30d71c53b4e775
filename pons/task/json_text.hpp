// Hostile text to JSON: bounded before it is built.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

inline constexpr std::size_t kMaxJsonBytes = 64 * 1024;
inline constexpr int kMaxJsonDepth = 16;  // arrays and objects inside one another, the outermost counts

// One JSON value (RFC 8259). Refuses text above kMaxJsonBytes, nesting above kMaxJsonDepth, bytes that are not UTF-8,
// numbers beyond a double, a name twice in one object, and anything after the value. Errors say at which byte.
[[nodiscard]] Expected<Json> parse_json(std::string_view text);

// What is at those places (JSON pointers of up to three names, without '~') of a text that need not be JSON to its end,
// as far as it can be read and as parse_json() would read on: a string's value, of anything else "". A place that the
// text does not come to is left out; of one that comes twice the first counts.
[[nodiscard]] std::map<std::string, std::string, std::less<>> glimpse(std::string_view text,
                                                                      std::span<const std::string_view> places);

// Whether arrays and objects lie deeper inside one another than `levels`, the outermost counts, in what a parser would
// read of `text`, be that as long as it may. Nothing is built: what is built so deep takes the stack of whoever copies
// it or writes it out.
[[nodiscard]] bool nests_deeper(std::string_view text, std::size_t levels);

// Text cut to `bytes` at a character border and with control characters made visible, those of ISO 8859 (U+0080 to
// U+009F) among them, which some terminals obey: fit for an error line.
[[nodiscard]] std::string excerpt(std::string_view text, std::size_t bytes = 64);

}  // namespace pons::task
