#include "pons/skills/dragged.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pons::skills {
namespace {

constexpr double kDragged_m = 0.03;  // less is nothing

// Over the whole of it, along the belt's axes, and so much further downstream.
ObjectBelief room_of(const ObjectBelief& object, double by_m) {
  const Eigen::Matrix2d turn = object.world_from_top.linear().topLeftCorner<2, 2>().cwiseAbs();
  const Eigen::Vector2d extent_m = turn * object.size_m.head<2>();
  ObjectBelief room;
  room.size_m = {extent_m.x() + by_m, extent_m.y(), object.size_m.z()};
  room.world_from_top.translation() = object.world_from_top.translation() + 0.5 * by_m * Vector3::UnitX();
  return room;
}

bool lies_in(const ObjectBelief& object, const ObjectBelief& room) {
  const Vector3 off = object.world_from_top.translation() - room.world_from_top.translation();
  return (off.head<2>().cwiseAbs().array() < 0.5 * room.size_m.head<2>().array()).all();
}

}  // namespace

void Dragged::put_back(const Company& company, double by_m, const std::vector<ObjectBelief>& objects, Time now) {
  if (by_m < kDragged_m) return;
  for (const Companion& companion : company) {
    if (companion.track == 0) continue;
    const auto object = std::ranges::find(objects, companion.track, &ObjectBelief::track);
    if (object == objects.end()) continue;
    std::erase_if(ones_, [&](const One& one) { return one.track == companion.track; });
    ones_.push_back({companion.track, companion.code, room_of(*object, by_m), now});
  }
}

// By its track or its label, or as anything that has come to lie in that room.
bool Dragged::is_seen(const One& one, const std::vector<ObjectBelief>& objects) {
  return std::ranges::any_of(objects, [&](const ObjectBelief& object) {
    if (object.track == 0 || object.last_seen <= one.since) return false;
    const bool same = object.track == one.track || (!one.code.empty() && object.code == one.code);
    return same || (one.gone && lies_in(object, one.room));
  });
}

void Dragged::look(const std::vector<ObjectBelief>& objects, double rode_m, double belt_ends_m) {
  for (One& one : ones_) {
    one.room.world_from_top.translation().x() += rode_m;
    one.gone = one.gone || std::ranges::find(objects, one.track, &ObjectBelief::track) == objects.end();
  }
  std::erase_if(ones_, [&](const One& one) {
    const double hindmost_m = one.room.world_from_top.translation().x() - 0.5 * one.room.size_m.x();
    return hindmost_m > belt_ends_m || is_seen(one, objects);
  });
}

void Dragged::add_unseen(std::vector<ObjectBelief>& objects, double speed_m_s, Time now) const {
  for (const One& one : ones_) {
    if (!one.gone) continue;
    ObjectBelief& room = objects.emplace_back(one.room);
    room.velocity_m_s.x() = speed_m_s;
    room.stamp = now;
  }
}

}  // namespace pons::skills
