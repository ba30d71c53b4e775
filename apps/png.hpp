// Pictures to files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "pons/core/error.hpp"

namespace pons::apps {

// rgb: height × width × 3, top row first. Whole or not at all: written beside `file`, then renamed.
[[nodiscard]] Expected<void> write_png(const std::filesystem::path& file, int width, int height,
                                       std::span<const std::uint8_t> rgb);

}  // namespace pons::apps
