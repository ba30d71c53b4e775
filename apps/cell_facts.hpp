// What the review may know of parcels and places of a cell: what was ordered, what is seen, what hangs on the cups.
#pragma once

#include <vector>

#include "pons/brain/dispatcher.hpp"
#include "pons/skills/cell.hpp"
#include "pons/task/facts.hpp"

namespace pons::apps {

// Of the cells of all arms, which must outlive it.
[[nodiscard]] task::Facts facts_of(std::vector<const skills::Cell*> cells, brain::Orders orders);

}  // namespace pons::apps
