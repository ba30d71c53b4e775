// Something perceived: a value with a frame, a time stamp and an uncertainty. Never the truth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/pose.hpp"
#include "pons/core/pose2.hpp"
#include "pons/core/time.hpp"

namespace pons {

// A loose object on a surface. Its frame sits in the middle of the top face, z up, x along the longer side.
struct ObjectBelief {
  std::uint32_t track = 0;  // stays with the object while it is tracked; never used again
  Time stamp;               // when the pose held
  Pose world_from_top = Pose::Identity();
  Vector3 velocity_m_s = Vector3::Zero();  // of that pose, world frame (what carries it, moves it)
  Vector3 size_m = Vector3::Zero();        // along its x, along its y, height above what carries it
  double position_sigma_m = 0;             // 1 σ, each axis
  double yaw_sigma_rad = 0;                // 1 σ
  double confidence = 0;                   // 0..1: seen how often, how consistently
  double flatness_m = 0;                   // RMS distance of the top's points from their plane
  int frames_seen = 0;
  Time last_seen;                          // when a camera last saw it (stamp may be predicted further)
  bool crowded = false;                    // touches, overlaps or leans on a neighbour
  std::string code;                        // label text, empty until read
  std::vector<std::string> disputed = {};  // both, of one that shows two; then `code` is empty
  int label_attempts = 0;                  // frames good enough to read a label on it, readable or not
  // No frame showed all of it. It has a code, which may be another's, its own label hidden; or no track (0), and the
  // view's border still cuts it.
  bool half_seen = false;
};

// Where a base is on its map, as of one scan, and what that scan saw beside the map.
struct BaseBelief {
  Time stamp;  // of the scan
  Pose2 map_from_base;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // of x, y (m) and yaw (rad), map axes
  AxisVector wheels_rad;                                 // measured at the stamp: odometry goes on from there
  int returns = 0;                                       // rays that came back
  double matched = 0;                                    // share of them that ends on the map
  double nearest_m = 0;                                  // the shortest
  Vector2 eye = Vector2::Zero();                         // where the rays come from, map frame
  std::vector<Vector2> ends;                             // where those that came back end, likewise
  std::vector<Vector2> unmapped;                         // of these, those that end far from anything on the map
  std::vector<float> ranges_m = {};                      // all that it measured, as in RgbdFrame::depth_m
};

// Between the two as seen from above, along the side of one of them that parts them most; less than 0: they overlap.
[[nodiscard]] double apart_m(const ObjectBelief& a, const ObjectBelief& b);

// Whether `upper` lies or leans on `lower`, as far as can be told: lifted first, the lower one would carry it along.
[[nodiscard]] bool lies_on(const ObjectBelief& upper, const ObjectBelief& lower);

// Whether the middle of `part` is within `whole`, as high as it, or both have a label and share so much room that they
// cannot be two: one of the two is not what it seems, and lifting `whole` may lift two.
[[nodiscard]] bool is_part(const ObjectBelief& part, const ObjectBelief& whole);

}  // namespace pons
