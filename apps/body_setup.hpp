// What a person says of a simulated body beside its parcels: who comes into which zone when, and where the arm is
// found, and what goes wrong.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "apps/assembly.hpp"
#include "pons/core/error.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct BodySetupOptions {
  std::vector<std::string> visits;  // ZONE@FROM+FOR, both in seconds
  std::string arm_at;               // Q1,Q2,…, one number an axis, rad; empty: at home
  std::string faults = "none";      // a plan of the world's, or a file
};
// --faults, which bridges take, too.
void add_faults_option(CLI::App& command, std::string& faults);
void add_body_setup_options(CLI::App& command, BodySetupOptions& options);

// Errors: another form, no such zone in this world, another number of axes, no such plan of faults or a bad one.
[[nodiscard]] Expected<BodySetup> body_setup(const BodySetupOptions& options, std::uint64_t seed,
                                             const world::World& world);

}  // namespace pons::apps
