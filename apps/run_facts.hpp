// What a run was made of, as its recording keeps it: enough to make the same run again, and to tell what is no longer
// the same.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pons/brain/errands.hpp"
#include "pons/core/error.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/runner/photographer.hpp"
#include "pons/world/world.hpp"

namespace pons::apps {

// All that decides what happens in a run.
struct RunFacts {
  std::string world;
  runner::Pace pace = runner::Pace::kLockstep;
  std::string attended;  // by which options others may have asked for something; empty: by none
  std::uint64_t seed = 1;
  std::uint64_t keep_free_mib = 0;
  bool depth = false;  // pictures of it are in the recording
  // Of a cell with an arm.
  std::optional<std::int64_t> parcels;  // nothing: the whole manifest, or a base, which sorts none
  std::string manifest;                 // what its file holds; empty: drawn
  std::string faults = "none";          // a plan of the world's, or the name of a file,
  std::string faults_file;              // and what that holds
  std::vector<std::string> visits;
  std::string arm_at;
  bool recovers = false;
  std::vector<brain::Errand> errands;  // of a base,
  bool stays = false;                  // which goes on until it is interrupted
};

// What a file holds. Error: it cannot be read.
[[nodiscard]] Expected<std::string> text_in(const std::filesystem::path& file);

// Which plan of faults was `given`: its name or, of a file that no world has, the file and what it holds. Error: that
// cannot be read.
[[nodiscard]] Expected<void> keep_faults(RunFacts& facts, const world::World& world, const std::string& given);

// At the beginning of each file of a recording: the facts, this program, and a digest of each file of the world.
// Errors: a file of the world, or this program's own, cannot be read.
[[nodiscard]] Expected<std::vector<record::mcap::Metadata>> notes_of(const RunFacts& facts, const world::World& world);

// What a recording says of its run.
struct RecordedRun {
  RunFacts facts;
  record::mcap::Texts made_of;      // the program and the world's files: what, and its version or digest
  std::string ended;                // "complete", or why not; empty: it does not say
  std::optional<Time> interrupted;  // by a person
};
// Errors: it does not say what it is of; what it says lacks something or is of another form, by name.
[[nodiscard]] Expected<RecordedRun> recorded_run(const record::McapReader& reader);

// What is otherwise now, a line each: the program, files of the world. Error: as for notes_of.
[[nodiscard]] Expected<std::vector<std::string>> what_changed(const RecordedRun& run, const world::World& world);

}  // namespace pons::apps
