// The room that a base has: what the map shows, and what the lidar saw beside it, or the base ran into, not long ago.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/time.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

class Floor {
 public:
  // Both must outlive it.
  Floor(const world::Grid& map, const world::Base& base);

  // What stands where the map shows nothing: remembered until a ray goes through it, or nobody has looked there for
  // long.
  void see(const BaseBelief& belief);
  // What the base ran into, at these points of the map: remembered for as long, and rays that go through it say
  // nothing, for they went over it, or under it, before.
  void feel(const std::vector<Vector2>& at, Time now);
  void forget_until(Time now);

  [[nodiscard]] const world::Grid& map() const { return map_; }
  // From a point to the nearest edge of what is known to stand there, as of now: up to kFar_m, below 0 within it. In a
  // cell that the map does not know, 0 at most.
  [[nodiscard]] double clearance_m(const Vector2& at) const;
  [[nodiscard]] double clearance_m(int column, int row) const;
  static constexpr double kFar_m = 0.8;
  // What the base needs to stand there, or to go by: its radius, and then some for a way that is planned.
  [[nodiscard]] double needed_m() const { return radius_m_ + 0.02; }
  [[nodiscard]] double wanted_m() const { return radius_m_ + 0.08; }
  [[nodiscard]] double comfortable_m() const { return radius_m_ + 0.20; }
  // Whether what was seen or felt beside the map is what takes the room there.
  [[nodiscard]] bool blocked_by_seen(const Vector2& at) const;
  // It changes whenever something new was seen or felt, and when something is forgotten.
  [[nodiscard]] std::uint64_t version() const { return version_; }

 private:
  enum class Sense : std::uint8_t { kSeen, kFelt };
  // All of them, which the map must contain.
  void take_in(const std::vector<Vector2>& at, Sense by, Time when);
  void mark(int column, int row);
  void forget(const std::function<bool(std::size_t cell)>& gone);

  const world::Grid& map_;
  double radius_m_;
  std::vector<Time> known_at_;      // a cell: when something was last known to be in it; the begin of time: never
  std::vector<bool> felt_;          // a cell: whether the base ran into that
  std::vector<std::size_t> known_;  // cells with something in them
  std::vector<float> known_m_;      // a cell: how far it is to the nearest of those; kFar_m at most
  std::uint64_t version_ = 0;
};

}  // namespace pons::skills
