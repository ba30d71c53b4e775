// Hostile text to JSON: bounded before it is built.
#pragma once

#include <cstddef>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

inline constexpr std::size_t kMaxJsonBytes = 64 * 1024;
inline constexpr int kMaxJsonDepth = 16;  // arrays and objects inside one another, the outermost counts

// One JSON value (RFC 8259). Refuses text above kMaxJsonBytes, nesting above kMaxJsonDepth, bytes that are not UTF-8,
// numbers beyond a double, a name twice in one object, and anything after the value. Errors say at which byte.
[[nodiscard]] Expected<Json> parse_json(std::string_view text);

// Text cut to `bytes` at a character border and with control characters made visible: fit for an error line.
[[nodiscard]] std::string excerpt(std::string_view text, std::size_t bytes = 64);

}  // namespace pons::task
