#include "pons/skills/base/floor.hpp"

#include <algorithm>
#include <cmath>

namespace pons::skills {
namespace {

// What stood there and is not seen any more may stand behind the base; who walked by has gone on.
constexpr Duration kRemembered = std::chrono::seconds(120);

}  // namespace

Floor::Floor(const world::Grid& map, const world::Base& base)
    : map_(map),
      radius_m_(base.radius_m),
      seen_(static_cast<std::size_t>(map.width()) * static_cast<std::size_t>(map.height())),
      seen_m_(seen_.size(), static_cast<float>(kFar_m)) {}

void Floor::mark(int column, int row) {
  const double step = map_.resolution_m();
  const int reach = static_cast<int>(std::ceil(kFar_m / step));
  for (int r = std::max(0, row - reach); r <= std::min(map_.height() - 1, row + reach); ++r) {
    for (int c = std::max(0, column - reach); c <= std::min(map_.width() - 1, column + reach); ++c) {
      const auto cell =
          static_cast<std::size_t>(r) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(c);
      const double away = step * (std::hypot(c - column, r - row) - 0.5);
      seen_m_[cell] = std::min(seen_m_[cell], static_cast<float>(away));
    }
  }
}

void Floor::see(const BaseBelief& belief) {
  bool news = false;
  for (const Vector2& at : belief.unmapped) {
    const int column = map_.column(at.x()), row = map_.row(at.y());
    const auto cell =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(column);
    if (seen_[cell] == Time{}) {
      known_.push_back(cell);
      mark(column, row);
      news = true;
    }
    seen_[cell] = belief.stamp;
  }
  if (news) ++version_;
}

void Floor::forget_until(Time now) {
  const std::size_t before = known_.size();
  std::erase_if(known_, [&](std::size_t cell) {
    if (now - seen_[cell] < kRemembered) return false;
    seen_[cell] = Time{};
    return true;
  });
  if (known_.size() == before) return;
  ++version_;
  std::ranges::fill(seen_m_, static_cast<float>(kFar_m));
  const auto width = static_cast<std::size_t>(map_.width());
  for (const std::size_t cell : known_) mark(static_cast<int>(cell % width), static_cast<int>(cell / width));
}

double Floor::clearance_m(int column, int row) const {
  const auto cell =
      static_cast<std::size_t>(row) * static_cast<std::size_t>(map_.width()) + static_cast<std::size_t>(column);
  const double mapped = std::min(kFar_m, map_.distance_m(column, row));
  const double both = std::min(mapped, static_cast<double>(seen_m_[cell]));
  return map_.ground(column, row) == world::Ground::kUnknown ? std::min(both, 0.0) : both;
}

double Floor::clearance_m(const Vector2& at) const {
  if (map_.ground(at) == world::Ground::kUnknown) return std::min(0.0, map_.distance_m(at));
  const auto cell = static_cast<std::size_t>(map_.row(at.y())) * static_cast<std::size_t>(map_.width()) +
                    static_cast<std::size_t>(map_.column(at.x()));
  return std::min({kFar_m, map_.distance_m(at), static_cast<double>(seen_m_[cell])});
}

bool Floor::blocked_by_seen(const Vector2& at) const {
  return map_.ground(at) == world::Ground::kFree && map_.distance_m(at) >= needed_m() && clearance_m(at) < needed_m();
}

}  // namespace pons::skills
