#include "pons/skills/base/way.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace pons::skills {
namespace {

constexpr double kDearest = 4;         // times its length costs a way that just fits
constexpr double kNear_m = 0.3;        // a start or goal that has too little room borrows a cell that near
constexpr double kLook_m = 0.025;      // along a line
constexpr double kSameRoom_m = 0.005;  // less is no loss

}  // namespace

double clearance_along(const Floor& floor, const Vector2& from, const Vector2& to) {
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kLook_m)));
  double least = Floor::kFar_m;
  for (int i = 0; i <= steps; ++i)
    least = std::min(least, floor.clearance_m(Vector2(from + (to - from) * (static_cast<double>(i) / steps))));
  return least;
}

WaySearch::WaySearch(const Floor& floor, const Vector2& from, const Vector2& to)
    : floor_(floor), from_(from), to_(to), version_(floor.version()), first_(cell_near(from)), goal_(cell_near(to)) {
  const auto cells = static_cast<std::size_t>(floor.map().width()) * static_cast<std::size_t>(floor.map().height());
  cost_.assign(cells, std::numeric_limits<float>::infinity());
  before_.assign(cells, -1);
  if (!first_) return;
  cost_[static_cast<std::size_t>(*first_)] = 0;
  open_.push_back({0, 0, *first_});
}

// The nearest cell with the room that a way needs: a base may stand closer to something than it would drive.
std::optional<std::int32_t> WaySearch::cell_near(const Vector2& at) const {
  const world::Grid& map = floor_.map();
  const int reach = static_cast<int>(std::ceil(kNear_m / map.resolution_m()));
  std::optional<std::int32_t> found;
  double nearest = kNear_m;
  for (int row = map.row(at.y()) - reach; row <= map.row(at.y()) + reach; ++row) {
    for (int column = map.column(at.x()) - reach; column <= map.column(at.x()) + reach; ++column) {
      if (column < 0 || row < 0 || column >= map.width() || row >= map.height()) continue;
      const double away = (map.middle(column, row) - at).norm();
      if (away >= nearest || floor_.clearance_m(column, row) < floor_.wanted_m()) continue;
      nearest = away;
      found = row * map.width() + column;
    }
  }
  return found;
}

void WaySearch::look_round(const Open& at) {
  static constexpr std::array<std::array<int, 2>, 8> kNeighbours{
      {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
  const world::Grid& map = floor_.map();
  const int row = at.cell / map.width(), column = at.cell % map.width();
  const Vector2 goal = map.middle(*goal_ % map.width(), *goal_ / map.width());
  for (const auto& [right, up] : kNeighbours) {
    const int c = column + right, r = row + up;
    if (c < 0 || r < 0 || c >= map.width() || r >= map.height()) continue;
    const double room = floor_.clearance_m(c, r);
    if (room < floor_.wanted_m()) continue;
    const double lacks =
        std::clamp((floor_.comfortable_m() - room) / (floor_.comfortable_m() - floor_.wanted_m()), 0.0, 1.0);
    const double length = map.resolution_m() * (right != 0 && up != 0 ? std::numbers::sqrt2 : 1.0);
    const auto cost = static_cast<float>(at.cost + length * (1 + (kDearest - 1) * lacks));
    const auto cell = static_cast<std::size_t>(r) * static_cast<std::size_t>(map.width()) + static_cast<std::size_t>(c);
    if (cost >= cost_[cell]) continue;
    cost_[cell] = cost;
    before_[cell] = at.cell;
    const auto bound = static_cast<float>(cost + (map.middle(c, r) - goal).norm());
    open_.push_back({bound, cost, static_cast<std::int32_t>(cell)});
    std::push_heap(open_.begin(), open_.end());
  }
}

std::optional<Expected<Way>> WaySearch::go_on(int cells) {
  if (!first_ || !goal_) return std::unexpected(blocked());
  for (; cells > 0; --cells) {
    if (open_.empty()) return std::unexpected(blocked());
    std::pop_heap(open_.begin(), open_.end());
    const Open at = open_.back();
    open_.pop_back();
    if (at.cell == *goal_) return pulled_straight();
    if (at.cost > cost_[static_cast<std::size_t>(at.cell)]) continue;  // a cheaper way there was found since
    look_round(at);
  }
  return std::nullopt;
}

// From each corner straight to the farthest one that can be reached with no less room than the cells had.
Way WaySearch::pulled_straight() const {
  const world::Grid& map = floor_.map();
  Way cells;
  for (std::int32_t cell = *goal_; cell >= 0; cell = before_[static_cast<std::size_t>(cell)])
    cells.push_back(map.middle(cell % map.width(), cell / map.width()));
  std::ranges::reverse(cells);
  cells.front() = from_;
  if (cells.size() == 1) cells.push_back(to_);
  cells.back() = to_;
  Way way{cells.front()};
  for (std::size_t at = 0; at + 1 < cells.size();) {
    std::size_t next = at + 1;
    double least = std::min(floor_.clearance_m(cells[at]), floor_.clearance_m(cells[next]));
    for (std::size_t far = at + 2; far < cells.size(); ++far) {
      least = std::min(least, floor_.clearance_m(cells[far]));
      if (clearance_along(floor_, cells[at], cells[far]) + kSameRoom_m >= std::min(least, floor_.comfortable_m()))
        next = far;
    }
    way.push_back(cells[next]);
    at = next;
  }
  return way;
}

double left_along(const Way& way, const Vector2& here) {
  double least = (way.back() - here).norm(), left = 0, best = 0;
  for (std::size_t leg = way.size() - 1; leg > 0; --leg) {
    const Vector2 along = way[leg] - way[leg - 1];
    const double share = along.squaredNorm() < 1e-12 ? 1 : (here - way[leg - 1]).dot(along) / along.squaredNorm();
    const Vector2 nearest = way[leg - 1] + std::clamp(share, 0.0, 1.0) * along;
    if ((nearest - here).norm() < least) {
      least = (nearest - here).norm();
      best = left + (way[leg] - nearest).norm();
    }
    left += along.norm();
  }
  return least + best;
}

Error WaySearch::blocked() const {
  const std::string goal = fmt::format("({:.2f}, {:.2f}) m", to_.x(), to_.y());
  const world::Grid& map = floor_.map();
  if (map.ground(to_) != world::Ground::kFree || map.distance_m(to_) < floor_.needed_m())
    return {fmt::format("the map has no room for the base at {}", goal), "navigate", "choose a goal in the open"};
  if (!first_) return {"the base stands where there is no room to drive", "navigate", "free it by hand"};
  if (!goal_)
    return {fmt::format("something that the map does not show stands at {}", goal), "navigate",
            "clear it, or go elsewhere"};
  return {fmt::format("there is no way to {}", goal), "navigate", "clear the way, or go elsewhere"};
}

}  // namespace pons::skills
