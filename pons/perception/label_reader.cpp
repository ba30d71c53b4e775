#define ZX_USE_UTF8 1
#include "pons/perception/label_reader.hpp"

#include <ZXing/ReadBarcode.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace pons::perception {
namespace {

constexpr double kAround_m = 0.012;  // beyond the print, so that the quiet zone is in
constexpr double kLeastPrint_m2 = 3e-4;

std::optional<cv::Point2d> project(const RgbdFrame& frame, const Vector3& world) {
  const Vector3 p = frame.world_from_optical.inverse() * world;
  if (p.z() < 0.05) return std::nullopt;
  const Intrinsics& in = frame.intrinsics;
  return cv::Point2d(in.cx + in.fx * p.x() / p.z(), in.cy + in.fy * p.y() / p.z());
}

// Where the ray through a pixel meets a height.
Eigen::Vector2d unproject(const RgbdFrame& frame, const cv::Point2d& pixel, double z_m) {
  const Intrinsics& in = frame.intrinsics;
  const Vector3 ray =
      frame.world_from_optical.linear() * Vector3((pixel.x - in.cx) / in.fx, (pixel.y - in.cy) / in.fy, 1);
  const Vector3 from = frame.world_from_optical.translation();
  return (from + ray * ((z_m - from.z()) / ray.z())).head<2>();
}

}  // namespace

cv::Rect LabelReader::print_area(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& texture,
                                 const Region& region, double top_z_m) const {
  cv::Rect cells;
  double printed = 0;
  for (const cv::Point& cell : region.cells) {
    if (texture(cell) == 0) continue;
    printed += 1;
    cells |= cv::Rect(cell, cv::Size(1, 1));
  }
  if (printed * view.cell_m * view.cell_m < kLeastPrint_m2) return {};
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const int x : {cells.x, cells.br().x}) {
    for (const int y : {cells.y, cells.br().y}) {
      const double out_x = x == cells.x ? -kAround_m : kAround_m, out_y = y == cells.y ? -kAround_m : kAround_m;
      const auto pixel =
          project(frame, Vector3(view.x0_m + x * view.cell_m + out_x, view.y0_m + y * view.cell_m + out_y, top_z_m));
      if (!pixel) return {};
      left = std::min(left, pixel->x), right = std::max(right, pixel->x);
      top = std::min(top, pixel->y), bottom = std::max(bottom, pixel->y);
    }
  }
  const cv::Rect area(cvFloor(left), cvFloor(top), cvCeil(right - left) + 1, cvCeil(bottom - top) + 1);
  return area & cv::Rect(0, 0, frame.intrinsics.width, frame.intrinsics.height);
}

std::vector<LabelReader::Found> LabelReader::decode(const RgbdFrame& frame, const cv::Rect& area) {
  // A cv::Mat knows no const data; nothing writes here. NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  auto* const pixels = const_cast<std::uint8_t*>(frame.rgb.data());
  const cv::Mat3b picture(frame.intrinsics.height, frame.intrinsics.width, reinterpret_cast<cv::Vec3b*>(pixels));
  cv::cvtColor(picture(area), grey_, cv::COLOR_RGB2GRAY);
  // Small modules are found more surely when enlarged; the plain picture goes first because it is four times cheaper.
  struct Attempt {
    int scale;
    ZXing::Binarizer binarizer;
  };
  for (const Attempt& attempt :
       {Attempt{1, ZXing::Binarizer::LocalAverage}, Attempt{2, ZXing::Binarizer::LocalAverage},
        Attempt{2, ZXing::Binarizer::GlobalHistogram}, Attempt{3, ZXing::Binarizer::LocalAverage}}) {
    const cv::Mat1b* source = &grey_;
    if (attempt.scale > 1) {
      cv::resize(grey_, large_, {}, attempt.scale, attempt.scale, cv::INTER_CUBIC);
      source = &large_;
    }
    const ZXing::ImageView image(source->data, source->cols, source->rows, ZXing::ImageFormat::Lum,
                                 static_cast<int>(source->step[0]));
    const auto hints = ZXing::DecodeHints()
                           .setFormats(ZXing::BarcodeFormat::QRCode)
                           .setTryHarder(true)
                           .setTryRotate(false)  // finder patterns are found at any angle
                           .setTryDownscale(false)
                           .setBinarizer(attempt.binarizer);
    std::vector<Found> found;
    for (const auto& result : ZXing::ReadBarcodes(image, hints)) {
      if (!result.isValid()) continue;
      cv::Point2d middle(0, 0);
      for (const auto& corner : result.position()) middle += cv::Point2d(corner.x, corner.y) / 4;
      found.push_back({result.text(), middle / attempt.scale + cv::Point2d(area.tl())});
    }
    if (!found.empty()) return found;
  }
  return {};
}

std::vector<LabelRead> LabelReader::read(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& texture,
                                         const Segments& segments, const std::vector<Sighting>& sightings,
                                         const std::vector<std::size_t>& wanted) {
  std::vector<LabelRead> reads;
  for (const std::size_t index : wanted) {
    const double top_z_m = sightings[index].world_from_top.translation().z();
    const cv::Rect area = print_area(frame, view, texture, segments.regions[index], top_z_m);
    if (area.width < 20 || area.height < 20) continue;
    for (const Found& found : decode(frame, area)) {
      const Eigen::Vector2d at = unproject(frame, found.middle, top_z_m);
      const cv::Point cell = view.cell(at.x(), at.y());
      const int label = view.contains(cell) ? segments.labels(cell) : 0;
      if (label == 0 || std::ranges::find(reads, found.code, &LabelRead::code) != reads.end()) continue;
      reads.push_back({found.code, static_cast<std::size_t>(label - 1), {at.x(), at.y(), top_z_m}});
    }
  }
  return reads;
}

}  // namespace pons::perception
