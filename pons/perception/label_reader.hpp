// Reads QR labels from the parts of a picture where objects with fine print lie.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "pons/core/image.hpp"
#include "pons/perception/segmentation.hpp"
#include "pons/perception/top_face.hpp"

namespace pons::perception {

struct LabelRead {
  std::string code;
  std::size_t sighting = 0;  // whose top face the label's middle lies on
  Vector3 middle_m;          // world
};

class LabelReader {
 public:
  // Tries the objects named in `wanted` (indices into `sightings`). In the order of `wanted`; no code twice. Two codes
  // on one sighting are two objects that were taken for one.
  std::vector<LabelRead> read(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& texture,
                              const Segments& segments, const std::vector<Sighting>& sightings,
                              const std::vector<std::size_t>& wanted);

 private:
  struct Found {
    std::string code;
    std::array<cv::Point2d, 4> corners;  // px, in the frame
    [[nodiscard]] cv::Point2d middle() const;
  };
  // Of the printed cells.
  [[nodiscard]] cv::Rect print_area(const RgbdFrame& frame, const TopView& view, const cv::Mat1b& print,
                                    double top_z_m) const;
  // Not those that were found before.
  [[nodiscard]] std::vector<Found> decode(const RgbdFrame& frame, const cv::Rect& area,
                                          const std::vector<Found>& before);
  // Leaves of the print what may be a label beside these.
  static void take_away(const RgbdFrame& frame, const TopView& view, const std::vector<Found>& labels, double top_z_m,
                        cv::Mat1b& print);

  cv::Mat1b grey_, large_;
};

}  // namespace pons::perception
