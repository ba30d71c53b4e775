// How near one word is to another: for "did you mean".
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace pons::task {

// Levenshtein's distance (1966): so many characters (bytes) to put in, take out or change. Costs the product of their
// lengths.
[[nodiscard]] std::size_t edits(std::string_view a, std::string_view b);

// Of `names` the nearest to that word, the first of several; empty where none is near enough to have been meant.
[[nodiscard]] std::string nearest(std::string_view word, std::span<const std::string> names);

}  // namespace pons::task
