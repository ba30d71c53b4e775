// How near one word is to another: for "did you mean".
#pragma once

#include <cstddef>
#include <string_view>

namespace pons::task {

// Levenshtein's distance (1966): so many characters (bytes) to put in, take out or change. Costs the product of their
// lengths.
[[nodiscard]] std::size_t edits(std::string_view a, std::string_view b);

}  // namespace pons::task
