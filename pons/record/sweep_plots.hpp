// The plots of many runs.
#pragma once

#include <string>
#include <vector>

#include "pons/record/plot.hpp"
#include "pons/record/sweep.hpp"

namespace pons::record {

// Of each world and plan of faults, seconds a parcel by seed, or of a base how far it ended from its goals; what was
// injected against what was not sorted, where anything was; how fast each run was made. Only plots that have a dot.
[[nodiscard]] std::vector<Plot> plots(const Sweep& sweep);

// Of the page: where the run of that number, from 0, has its row.
[[nodiscard]] std::string anchor(std::size_t run);

}  // namespace pons::record
