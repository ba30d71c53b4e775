// pons run of a world with a base: from the first task to the report.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/foxglove_sink.hpp"
#include "apps/ros_options.hpp"
#include "apps/rounds.hpp"
#include "apps/run_along.hpp"
#include "apps/run_kit.hpp"
#include "pons/brain/errands.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

struct RoundsOptions {
  std::vector<std::string> tasks;  // FILE or FILE@SECONDS; none: the world's
  std::uint64_t seed = 1;
  std::string journal;
  std::filesystem::path report, log, picture, socket, speech;
  runner::Pace pace = runner::Pace::kLockstep;
  Explain explain = Explain::kNothing;
  Alerts alerts = Alerts::kTold;
  std::uint64_t keep_free = runner::kKeptFree;  // bytes on the journal's disk
  RosOptions ros = {};
  RecordOptions record = {};
  FoxgloveOptions foxglove = {};
  const Onlooker* onlooker = nullptr;
  RoundsSetup::Ends ends = RoundsSetup::Ends::kWithItsTasks;
  std::string of_a_cell = {};  // an option was given that only a cell with an arm knows: its name
};

// The tasks in those files, each to be asked for at its time. Error: a file that is none, a time that is none.
[[nodiscard]] Expected<std::vector<brain::Errand>> errands_of(const std::vector<std::string>& tasks);

// What is asked of the base: what the options name, else what its world has. Errors also: an option that only a cell
// knows; nothing is asked.
[[nodiscard]] Expected<std::vector<brain::Errand>> errands_for(const RoundsOptions& options, const world::World& world);

// Returns the exit code. Bad unless every task succeeded and the referee found nothing; with an onlooker, good if the
// run could be made. `facts`: all but what is asked of the base.
[[nodiscard]] int run_rounds(const RoundsOptions& options, RunFacts facts, world::World world);

}  // namespace pons::apps
