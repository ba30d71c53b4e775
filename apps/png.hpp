// Pictures as PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

// rgb: height × width × 3, top row first. Whole or not at all: written beside `file`, then renamed.
[[nodiscard]] Expected<void> write_png(const std::filesystem::path& file, int width, int height,
                                       std::span<const std::uint8_t> rgb);

// One of 16 bits a pixel, appended to `png`. Error: it cannot be drawn; what is appended is not to be used then.
[[nodiscard]] Expected<void> append_png(int width, int height, std::span<const std::uint16_t> grey,
                                        std::vector<std::uint8_t>& png);

}  // namespace pons::apps
