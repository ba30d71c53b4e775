// One run of a world, as pons run is asked for it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/body_setup.hpp"
#include "apps/foxglove_sink.hpp"
#include "apps/ros_options.hpp"
#include "apps/run_along.hpp"
#include "apps/run_kit.hpp"
#include "apps/run_recorder.hpp"

namespace pons::apps {

struct RunOptions {
  std::string world;
  ParcelOptions parcels;
  BodySetupOptions body;
  std::string journal;
  std::filesystem::path report, log, picture, socket, speech;
  std::vector<std::string> tasks;
  RosOptions ros;
  RecordOptions record;
  FoxgloveOptions foxglove;
  std::uint64_t keep_free_mib = runner::kKeptFree >> 20;
  bool realtime = false, lockstep = false, quiet = false, explain = false, recover = false, stay = false;
  const Onlooker* onlooker = nullptr;  // of a run that is made for its sake: nothing is told of how it went
};

// Returns the exit code. With an onlooker: good, however the run went, if it could be made.
[[nodiscard]] int run(const RunOptions& options);

}  // namespace pons::apps
