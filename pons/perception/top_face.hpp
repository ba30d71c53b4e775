// Pose and size of one object from its cells.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "pons/core/both.hpp"
#include "pons/core/pose.hpp"
#include "pons/perception/segmentation.hpp"
#include "pons/perception/top_view.hpp"

namespace pons::perception {

enum class Shape : std::uint8_t {
  kFlat,  // box, mailer: the top is a plane
  kTube,  // a ridge along the longer side
  kBag,   // rounded both ways
};

// What one frame says of one object. The frame `top`: middle of the top face (tube: of the ridge; bag: above the
// centroid), x along the longer side, z the face's normal where it leans by more than 3°, else straight up.
struct Sighting {
  int label = 0;  // in Segments::labels
  Pose world_from_top = Pose::Identity();
  double yaw_rad = 0;                // about world z; modulo π
  Vector3 size_m = Vector3::Zero();  // along x, along y, height of the top above the belt
  double flatness_m = 0;             // RMS distance of the top from its plane
  double tilt_rad = 0;
  double fill = 0;                        // share of the rectangle that was seen
  std::vector<Eigen::Vector2d> hull_m{};  // world: corners of the convex hull of what was seen of it
  Shape shape = Shape::kFlat;
  bool complete = false;  // the whole outline was seen: pose and size mean something
  bool covered = false;   // something lies or leans on it
  bool crowded = false;
  bool near_robot = false;
  bool at_screen = false;
  bool at_border = false;
  bool sliver = false;  // too narrow for an object: a piece of one
  // Where its top is, on the ground plan: middle and half sides along x and y of `top`.
  [[nodiscard]] bool covers(double x_m, double y_m, double margin_m) const;
  // Whether all that was seen of `part` lies on it, and about as high.
  [[nodiscard]] bool holds(const Sighting& part) const;
};

// One sighting a region, in their order; `both` measures some of them beside the others.
[[nodiscard]] std::vector<Sighting> measure(const TopView& view, const Segments& segments, const Both& both);

}  // namespace pons::perception
