// What lay so close to a parcel that it may have come along when that was lifted: tape, a flap or film that hooks. The
// wrist feels most of it at once. What it does not feel is missed later: strays.hpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "pons/core/belief.hpp"

namespace pons::skills {

struct Companion {
  std::uint32_t track = 0;  // 0: the cameras' view still cuts it; felt it is, missed by nobody
  std::string code;         // empty: not read
  Eigen::Vector2d aside_m;  // the middle of its top from that of the load's, tip frame
  Vector3 size_m = Vector3::Zero();

  bool operator==(const Companion&) const = default;
};
using Company = std::vector<Companion>;

// Of `target`, taken hold of with the tip turned like that.
[[nodiscard]] Company company_of(const ObjectBelief& target, const std::vector<ObjectBelief>& objects,
                                 const Eigen::Matrix3d& world_from_tip);

}  // namespace pons::skills
