// Pictures as JPEG.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "pons/core/error.hpp"

namespace pons::apps {

// rgb: height × width × 3, top row first. Quality 90, colour at half resolution. Errors: no pixels, or more than JPEG's
// 65,500 on a side.
[[nodiscard]] Expected<void> encode_jpeg(std::span<const std::uint8_t> rgb, int width, int height,
                                         std::vector<std::uint8_t>& jpeg);

}  // namespace pons::apps
