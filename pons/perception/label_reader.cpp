#define ZX_USE_UTF8 1
#include "pons/perception/label_reader.hpp"

#include <ZXing/ReadBarcode.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

namespace pons::perception {
namespace {

constexpr double kAround_m = 0.012;  // beyond the print, so that the quiet zone is in
constexpr double kLeastPrint_m2 = 3e-4;
constexpr double kOutline = 1.25;  // as large as a label: its modules, and the cells that they blur into
constexpr double kBlock = 0.6;     // of a label's side: another is a block as large; edges and tape are lines

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

cv::Point2d LabelReader::Found::middle() const {
  return std::accumulate(corners.begin(), corners.end(), cv::Point2d()) / 4;
}

cv::Rect LabelReader::print_area(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& print,
                                 double top_z_m) const {
  if (cv::countNonZero(print) * view.cell_m * view.cell_m < kLeastPrint_m2) return {};
  const cv::Rect cells = cv::boundingRect(print);
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

std::vector<LabelReader::Found> LabelReader::decode(const RgbdFrame& frame, const cv::Rect& area,
                                                    const std::vector<Found>& before) {
  // A cv::Mat knows no const data; nothing writes here. NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast)
  auto* const pixels = const_cast<std::uint8_t*>(frame.rgb.data());
  const cv::Mat3b picture(frame.intrinsics.height, frame.intrinsics.width, reinterpret_cast<cv::Vec3b*>(pixels));
  cv::cvtColor(picture(area), grey_, cv::COLOR_RGB2GRAY);
  for (const Found& label : before) {
    std::vector<cv::Point> outline;
    for (const cv::Point2d& corner : label.corners) outline.push_back(cv::Point(corner) - area.tl());
    cv::fillConvexPoly(grey_, outline, cv::Scalar(255));
  }
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
      Found label{.code = result.text()};
      std::ranges::transform(result.position(), label.corners.begin(), [&](const auto& corner) {
        return cv::Point2d(corner.x, corner.y) / attempt.scale + cv::Point2d(area.tl());
      });
      found.push_back(std::move(label));
    }
    if (!found.empty()) return found;
  }
  return {};
}

void LabelReader::take_away(const RgbdFrame& frame, const TopView& view, const std::vector<Found>& labels,
                            double top_z_m, cv::Mat1b& print) {
  double side = 0;  // cells
  for (const Found& label : labels) {
    std::vector<cv::Point> outline;
    for (const cv::Point2d& corner : label.corners) {
      const Eigen::Vector2d at = unproject(frame, label.middle() + kOutline * (corner - label.middle()), top_z_m);
      outline.push_back(view.cell(at.x(), at.y()));
    }
    side = std::max(side, cv::norm(outline[1] - outline[0]) / kOutline);
    cv::fillConvexPoly(print, outline, cv::Scalar(0));
  }
  const int block = std::max(1, cvRound(kBlock * side));
  cv::morphologyEx(print, print, cv::MORPH_OPEN, cv::Mat1b(block, block, 1));
}

std::vector<LabelRead> LabelReader::read(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& texture,
                                         const Segments& segments, const std::vector<Sighting>& sightings,
                                         const std::vector<std::size_t>& wanted) {
  std::vector<LabelRead> reads;
  for (const std::size_t index : wanted) {
    const double top_z_m = sightings[index].world_from_top.translation().z();
    cv::Mat1b print(texture.size(), 0);
    for (const cv::Point& cell : segments.regions[index].cells) print(cell) = texture(cell);
    // All of it, then what is printed beside what was found: another label may be legible only when enlarged.
    std::vector<Found> all, more;
    do {
      const cv::Rect area = print_area(frame, view, print, top_z_m);
      if (area.width < 20 || area.height < 20) break;
      more = decode(frame, area, all);
      all.insert(all.end(), more.begin(), more.end());
      take_away(frame, view, more, top_z_m, print);
    } while (!more.empty());
    for (const Found& found : all) {
      const Eigen::Vector2d at = unproject(frame, found.middle(), top_z_m);
      const cv::Point cell = view.cell(at.x(), at.y());
      const int label = view.contains(cell) ? segments.labels(cell) : 0;
      if (label == 0 || std::ranges::find(reads, found.code, &LabelRead::code) != reads.end()) continue;
      reads.push_back({found.code, static_cast<std::size_t>(label - 1), {at.x(), at.y(), top_z_m}});
    }
  }
  return reads;
}

}  // namespace pons::perception
