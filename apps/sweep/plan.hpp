// What a sweep is to make, which is kept in its folder: SWEEP/sweep.json.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/world/faults.hpp"

namespace pons::apps {

struct SweepFaults {
  std::string name;   // the plan's
  std::string given;  // as --faults has it: a name, or a file
  bool operator==(const SweepFaults&) const = default;
};

struct SweepPlan {
  std::vector<std::string> worlds;
  std::vector<SweepFaults> faults;
  std::vector<std::uint64_t> seeds;
  std::optional<std::int64_t> parcels;    // nothing: as many as pons run takes
  std::vector<std::string> further;       // options of pons run
  std::filesystem::path folder;           // where they are made: relative paths begin there
  std::filesystem::path worlds_folder;    // absolute
  std::vector<std::string> command = {};  // as it was given the first time
};

struct PlannedRun {
  std::string name;  // "parcel_cell/robin/seed-0007", its folder below the sweep's
  std::string world;
  SweepFaults faults;
  std::uint64_t seed = 0;
  std::vector<std::string> words;  // after `pons`, without files of its own
};

// Worlds, then plans of faults, then seeds.
[[nodiscard]] std::vector<PlannedRun> runs_of(const SweepPlan& plan);

inline constexpr const char* kPlanFile = "sweep.json";
[[nodiscard]] nlohmann::ordered_json to_json(const SweepPlan& plan);
// Errors, by the file's name: there is none, it is cut, of another version or no plan.
[[nodiscard]] Expected<SweepPlan> read_plan(const std::filesystem::path& sweep);

// What another plan has otherwise, for a person: "seeds 1-3 instead of 1-4"; empty where nothing is.
[[nodiscard]] std::string differences(const SweepPlan& plan, const SweepPlan& other);
// "1-20,31"
[[nodiscard]] std::string seeds_text(const std::vector<std::uint64_t>& seeds);

// All that a run's outcome depends on, as far as files say it.
struct Basis {
  std::string program;  // digest of this program's file; sixteen hexadecimal digits, as the other
  std::string files;    // of the world, its robot, the plan of faults, and files that further options name
  bool operator==(const Basis&) const = default;
};
// Relative paths begin in the working folder, which must be the plan's. Errors: a file cannot be read, the world or the
// plan of faults cannot be loaded.
[[nodiscard]] Expected<std::string> program_digest();
[[nodiscard]] Expected<std::string> files_digest(const SweepPlan& plan, const std::string& world,
                                                 const SweepFaults& faults);

}  // namespace pons::apps
