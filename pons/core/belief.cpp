#include "pons/core/belief.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pons {
namespace {

constexpr double kSure = 0.5;        // of the confidence: below it something hides a part of the object
constexpr double kOverlap_m = 0.01;  // footprints that share less only touch
constexpr double kHidden_m = 0.03;   // how far one may go on under what leans on it
constexpr double kLargerPart = 1.3;  // times the whole: of equal ones, each may be a part
constexpr double kSameHeight_m = 0.02;
constexpr double kShared_m = 0.02, kLevel_m = 0.01;  // footprints share more, as high: one thing cut in two
constexpr double kAsWide = 0.75;     // times the wider one, less what may be shared: narrower, they are two
constexpr double kUpright = 0.9986;  // cosine of 3 degrees
constexpr Duration kTogether = std::chrono::milliseconds(700);  // seen last: two pictures
constexpr int kGlimpses = 3;  // seen less often, and not read, it may have been a bad cut between two

bool leans(const ObjectBelief& object) { return object.world_from_top.linear()(2, 2) < kUpright; }

bool is_glimpse(const ObjectBelief& object) { return object.frames_seen < kGlimpses && object.code.empty(); }

// How far the footprint reaches along that direction from one end to the other.
double extent_m(const ObjectBelief& object, const Eigen::Vector2d& along) {
  double extent_m = 0;
  for (const Eigen::Index side : {0, 1})
    extent_m += object.size_m[side] * std::abs(along.dot(object.world_from_top.linear().col(side).head<2>()));
  return extent_m;
}

struct Gap {
  double apart_m = -std::numeric_limits<double>::infinity();
  Eigen::Vector2d along = Eigen::Vector2d::UnitX();
};

// Two rectangles are apart when they are along a side of one of them.
Gap gap_between(const ObjectBelief& a, const ObjectBelief& b) {
  const Vector3 between = b.world_from_top.translation() - a.world_from_top.translation();
  Gap widest;
  for (const ObjectBelief* one : {&a, &b}) {
    for (const Eigen::Index side : {0, 1}) {
      const Eigen::Vector2d along = one->world_from_top.linear().col(side).head<2>().normalized();
      const double reach_m = 0.5 * (extent_m(a, along) + extent_m(b, along));
      const double apart_m = std::abs(along.dot(between.head<2>())) - reach_m;
      if (apart_m > widest.apart_m) widest = {apart_m, along};
    }
  }
  return widest;
}

bool overlap(const ObjectBelief& a, const ObjectBelief& b, double least_m) { return apart_m(a, b) <= -least_m; }

}  // namespace

double apart_m(const ObjectBelief& a, const ObjectBelief& b) { return gap_between(a, b).apart_m; }

bool lies_on(const ObjectBelief& upper, const ObjectBelief& lower) {
  if (upper.track == lower.track || is_glimpse(upper)) return false;
  const bool is_hidden = lower.confidence < kSure;
  if (!overlap(upper, lower, leans(upper) && is_hidden ? -kHidden_m : kOverlap_m)) return false;
  // What leans lies on what stands, however high. Else the lower one must look hidden, too: neighbours that only touch
  // seem to overlap when one was measured too large.
  if (leans(upper) != leans(lower)) return leans(upper);
  return is_hidden && upper.world_from_top.translation().z() > lower.world_from_top.translation().z();
}

namespace {

// What is cut in two is about as wide on either side of the cut.
bool as_wide(const ObjectBelief& a, const ObjectBelief& b) {
  const Eigen::Vector2d across = gap_between(a, b).along.unitOrthogonal();
  const auto [narrower_m, wider_m] = std::minmax({extent_m(a, across), extent_m(b, across)});
  return narrower_m > kAsWide * wider_m - kShared_m;
}

// Where one stands, no other does: a thing with two labels was cut between them.
bool share_room(const ObjectBelief& a, const ObjectBelief& b) {
  const double rise_m = b.world_from_top.translation().z() - a.world_from_top.translation().z();
  const bool named = !a.code.empty() && !b.code.empty(), whole = std::min(a.confidence, b.confidence) >= kSure;
  const bool together = a.last_seen <= b.last_seen + kTogether && b.last_seen <= a.last_seen + kTogether;
  return named && whole && together && std::abs(rise_m) < kLevel_m && !leans(a) && !leans(b) &&
         overlap(a, b, kShared_m) && as_wide(a, b);
}

}  // namespace

bool is_part(const ObjectBelief& part, const ObjectBelief& whole) {
  if (part.track == whole.track || is_glimpse(part)) return false;
  if (share_room(part, whole)) return true;
  if (part.size_m.head<2>().prod() > kLargerPart * whole.size_m.head<2>().prod()) return false;
  const Vector3 off = whole.world_from_top.inverse() * part.world_from_top.translation();
  return std::abs(off.x()) < 0.5 * whole.size_m.x() - kOverlap_m &&
         std::abs(off.y()) < 0.5 * whole.size_m.y() - kOverlap_m && std::abs(off.z()) < kSameHeight_m;
}

}  // namespace pons
