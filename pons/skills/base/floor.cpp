#include "pons/skills/base/floor.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace pons::skills {
namespace {

constexpr Duration kRemembered = std::chrono::minutes(5);  // where nobody has looked since
// A ray goes through a point that it passes so closely and ends so far beyond.
constexpr double kThrough_m = 0.02, kBeyond_m = 0.15;

bool seen_through(const BaseBelief& belief, const Vector2& at) {
  const Vector2 to = at - belief.eye;
  return std::ranges::any_of(belief.ends, [&](const Vector2& end) {
    const Vector2 ray = end - belief.eye;
    const double length_m = ray.norm(), along_m = to.dot(ray) / length_m;
    return along_m > 0 && along_m + kBeyond_m < length_m &&
           std::abs(ray.x() * to.y() - ray.y() * to.x()) < kThrough_m * length_m;
  });
}

}  // namespace

Floor::Floor(const world::Grid& map, const world::Base& base)
    : map_(map),
      radius_m_(base.radius_m),
      known_at_(static_cast<std::size_t>(map.width()) * static_cast<std::size_t>(map.height())),
      felt_(known_at_.size()),
      known_m_(known_at_.size(), static_cast<float>(kFar_m)) {}

void Floor::mark(int column, int row) {
  const double step = map_.resolution_m();
  const int reach = static_cast<int>(std::ceil(kFar_m / step));
  for (int r = std::max(0, row - reach); r <= std::min(map_.height() - 1, row + reach); ++r) {
    for (int c = std::max(0, column - reach); c <= std::min(map_.width() - 1, column + reach); ++c) {
      const auto cell =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(c);
      const double away = step * (std::hypot(c - column, r - row) - 0.5);
      known_m_[cell] = std::min(known_m_[cell], static_cast<float>(away));
    }
  }
}

void Floor::take_in(const std::vector<Vector2>& points, Sense by, Time when) {
  bool news = false;
  for (const Vector2& at : points) {
    const int column = map_.column(at.x()), row = map_.row(at.y());
    const auto cell =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(column);
    if (known_at_[cell] == Time{}) {
      known_.push_back(cell);
      mark(column, row);
      news = true;
    }
    known_at_[cell] = when;
    if (by == Sense::kFelt) felt_[cell] = true;
  }
  if (news) ++version_;
}

void Floor::see(const BaseBelief& belief) {
  take_in(belief.unmapped, Sense::kSeen, belief.stamp);
  forget([&](std::size_t cell) {
    const auto width = static_cast<std::size_t>(map_.width());
    return !felt_[cell] && known_at_[cell] < belief.stamp &&
           seen_through(belief, map_.middle(static_cast<int>(cell % width), static_cast<int>(cell / width)));
  });
}

void Floor::feel(const std::vector<Vector2>& at, Time now) {
  std::vector<Vector2> on_map;
  std::ranges::copy_if(at, std::back_inserter(on_map), [this](const Vector2& point) { return map_.contains(point); });
  take_in(on_map, Sense::kFelt, now);
}

void Floor::forget_until(Time now) {
  forget([&](std::size_t cell) { return now - known_at_[cell] >= kRemembered; });
}

void Floor::forget(const std::function<bool(std::size_t cell)>& gone) {
  const std::size_t forgotten = std::erase_if(known_, [&](std::size_t cell) {
    const bool is_gone = gone(cell);
    if (is_gone) known_at_[cell] = Time{}, felt_[cell] = false;
    return is_gone;
  });
  if (forgotten == 0) return;
  ++version_;
  std::ranges::fill(known_m_, static_cast<float>(kFar_m));
  const auto width = static_cast<std::size_t>(map_.width());
  for (const std::size_t cell : known_) mark(static_cast<int>(cell % width), static_cast<int>(cell / width));
}

double Floor::clearance_m(int column, int row) const {
  const auto cell =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(column);
  const double mapped = std::min(kFar_m, map_.distance_m(column, row));
  const double both = std::min(mapped, static_cast<double>(known_m_[cell]));
  return map_.ground(column, row) == world::Ground::kUnknown ? std::min(both, 0.0) : both;
}

double Floor::clearance_m(const Vector2& at) const {
  if (map_.ground(at) == world::Ground::kUnknown) return std::min(0.0, map_.distance_m(at));
  const auto cell = static_cast<std::size_t>(map_.row(at.y())) * static_cast<std::size_t>(map_.width()) +
                    static_cast<std::size_t>(map_.column(at.x()));
  return std::min({kFar_m, map_.distance_m(at), static_cast<double>(known_m_[cell])});
}

bool Floor::blocked_by_seen(const Vector2& at) const {
  return map_.ground(at) == world::Ground::kFree && map_.distance_m(at) >= needed_m() && clearance_m(at) < needed_m();
}

}  // namespace pons::skills
