// Seeds as a person lists them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

inline constexpr std::size_t kMostRuns = 100'000;  // of one sweep

// "1-20,31" to 1, 2, …, 20, 31: in the order in which they are written. Errors: another form, a range that goes down,
// a seed that is named twice, more than kMostRuns.
[[nodiscard]] Expected<std::vector<std::uint64_t>> seeds_of(std::string_view text);

}  // namespace pons::apps
