// What the review may know of parcels and places of a cell: what was ordered, what is seen, what hangs on the cups.
#pragma once

#include "pons/brain/dispatcher.hpp"
#include "pons/skills/cell.hpp"
#include "pons/task/facts.hpp"

namespace pons::apps {

// `cell` must outlive it.
[[nodiscard]] task::Facts facts_of(const skills::Cell& cell, brain::Orders orders);

}  // namespace pons::apps
