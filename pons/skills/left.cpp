#include "pons/skills/left.hpp"

#include <algorithm>

namespace pons::skills {
namespace {

constexpr double kSlides_m = 0.05;  // when it is let go of just over the belt
// What is seen in another's stead is as high, but for errors: it lies neither on nor under it. So far in its place, and
// so often seen as a whole, it is no neighbour that was measured too large.
constexpr double kLevel_m = 0.04, kHigher_m = 0.01, kNoRoom_m = 0.05;
constexpr int kFrames = 3;
constexpr double kWhole = 0.5;  // of the confidence

bool is_in_stead_of(const ObjectBelief& left, const ObjectBelief& seen) {
  const double rise_m = seen.world_from_top.translation().z() - left.world_from_top.translation().z();
  return seen.track != 0 && !seen.code.empty() && seen.last_seen > left.last_seen && seen.frames_seen >= kFrames &&
         seen.confidence >= kWhole && rise_m > -kLevel_m && rise_m < kHigher_m && apart_m(seen, left) < -kNoRoom_m;
}

}  // namespace

void recognise_left(std::vector<ObjectBelief>& left, const std::vector<ObjectBelief>& objects,
                    std::map<std::uint32_t, std::string>& labelled) {
  for (const ObjectBelief& object : objects) {
    if (object.track == 0) continue;
    std::erase_if(left, [&](const ObjectBelief& one) {
      if (one.code.empty()) return false;
      const Vector3 off = object.world_from_top.translation() - one.world_from_top.translation();
      const bool lies_there = object.code.empty() && object.last_seen > one.last_seen && off.norm() < kSlides_m;
      const bool reads_so = object.code == one.code;
      // Its code is known, and shows again on a part of it.
      if (lies_there || (reads_so && object.half_seen)) labelled[object.track] = one.code;
      return lies_there || reads_so;
    });
  }
  std::erase_if(left, [&](const ObjectBelief& one) {
    return !one.code.empty() &&
           std::ranges::any_of(objects, [&](const ObjectBelief& object) { return is_in_stead_of(one, object); });
  });
}

}  // namespace pons::skills
