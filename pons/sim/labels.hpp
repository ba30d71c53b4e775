// Pictures of labels: a QR code of the parcel's id with a quiet zone, as printed. Private to pons/sim.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/random.hpp"

namespace pons::sim {

// kLabelPixels × kLabelPixels RGB, top row first. Text: upper-case letters, digits and " $%*+-./:" need the smallest
// code; anything else makes a larger one, which a camera may be too far away to read.
[[nodiscard]] std::vector<std::uint8_t> draw_label(const std::string& text);
// Blots it so that no reader decodes it: across the middle, and over two of the three corner marks.
void spoil_label(std::vector<std::uint8_t>& pixels, Random random);

}  // namespace pons::sim
