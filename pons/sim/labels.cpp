#include "pons/sim/labels.hpp"

#include <algorithm>
#include <qrcodegen/qrcodegen.hpp>

#include "pons/sim/compose.hpp"

namespace pons::sim {
namespace {

constexpr int kQuietModules = 2;

void blot(std::vector<std::uint8_t>& pixels, double x, double y, double radius, std::uint8_t shade) {
  for (int row = 0; row < kLabelPixels; ++row) {
    for (int column = 0; column < kLabelPixels; ++column) {
      const double dx = column - x, dy = row - y;
      if (dx * dx + dy * dy > radius * radius) continue;
      std::fill_n(pixels.begin() + 3 * (row * kLabelPixels + column), 3, shade);
    }
  }
}

}  // namespace

std::vector<std::uint8_t> draw_label(const std::string& text) {
  const qrcodegen::QrCode code = qrcodegen::QrCode::encodeText(text.c_str(), qrcodegen::QrCode::Ecc::MEDIUM);
  const int modules = code.getSize() + 2 * kQuietModules;
  std::vector<std::uint8_t> pixels(3UL * kLabelPixels * kLabelPixels, 245);
  for (int row = 0; row < kLabelPixels; ++row) {
    for (int column = 0; column < kLabelPixels; ++column) {
      const int x = column * modules / kLabelPixels - kQuietModules;
      const int y = row * modules / kLabelPixels - kQuietModules;
      if (code.getModule(x, y)) std::fill_n(pixels.begin() + 3 * (row * kLabelPixels + column), 3, std::uint8_t{15});
    }
  }
  return pixels;
}

void spoil_label(std::vector<std::uint8_t>& pixels, Random random) {
  constexpr double kSide = kLabelPixels;
  blot(pixels, 0.18 * kSide, 0.18 * kSide, random.uniform(0.16, 0.20) * kSide, 60);
  blot(pixels, 0.82 * kSide, 0.18 * kSide, random.uniform(0.16, 0.20) * kSide, 230);
  for (int i = 0; i < 5; ++i) {
    const double x = random.uniform(0.2, 0.8) * kSide, y = random.uniform(0.3, 0.8) * kSide;
    blot(pixels, x, y, random.uniform(0.07, 0.13) * kSide, i % 2 == 0 ? 60 : 230);
  }
}

}  // namespace pons::sim
