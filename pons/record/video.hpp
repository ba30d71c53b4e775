// Pictures of a recording as a film, by ffmpeg, a program of its own. One thread at a time; blocks on it and on the
// disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "pons/core/error.hpp"
#include "pons/record/mcap_reader.hpp"
#include "pons/record/new_file.hpp"

namespace pons::record {

struct Filmed {
  std::uint64_t pictures = 0;
  double a_second = 0;  // of the film: the pictures' mean rate by log time
  std::optional<Damage> damage;
};

// The messages of a topic of sensor_msgs/msg/CompressedImage, JPEG or PNG all of them. There is a whole file at `path`
// afterwards, or what was there before. Errors: there is no such topic, it has no pictures or other ones, one of them
// cannot be read; ffmpeg is not installed, or fails; `path` is the recording, or exists and may not be overwritten.
[[nodiscard]] Expected<Filmed> export_mp4(const McapReader& reader, const std::string& topic,
                                          const std::filesystem::path& path, Overwrite overwrite);

}  // namespace pons::record
