// What a person asks of a run's safety: who comes into which zone when, and where the arm is found.
#pragma once

#include <string>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/sim/simulation.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// Of "ZONE@FROM+FOR", both in seconds. Errors: another form, no such zone in this world.
[[nodiscard]] Expected<std::vector<sim::Visit>> visits_of(const std::vector<std::string>& texts,
                                                          const world::World& world);

// Of "Q1,Q2,…", one number an axis, rad. Errors: another form or count.
[[nodiscard]] Expected<AxisVector> arm_at(const std::string& text, const world::World& world);

}  // namespace pons::apps
