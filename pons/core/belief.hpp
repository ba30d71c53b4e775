// Something perceived: a value with a frame, a time stamp and an uncertainty. Never the truth.
#pragma once

#include <cstdint>
#include <string>

#include "pons/core/pose.hpp"
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
  Time last_seen;          // when a camera last saw it (stamp may be predicted further)
  int missing = 0;         // in so many frames since, what shows where it should be is not it
  bool crowded = false;    // touches, overlaps or leans on a neighbour
  std::string code;        // label text, empty until read
  bool two_codes = false;  // another code was read on it, too
  int label_attempts = 0;  // frames good enough to read a label on it, readable or not
};

// Whether `upper` lies or leans on `lower`, as far as can be told: lifted first, the lower one would carry it along.
[[nodiscard]] bool lies_on(const ObjectBelief& upper, const ObjectBelief& lower);

// Whether the middle of `part` is within `whole`, as high as it: one of the two is not what it seems, and lifting
// `whole` may lift two.
[[nodiscard]] bool is_part(const ObjectBelief& part, const ObjectBelief& whole);

}  // namespace pons
