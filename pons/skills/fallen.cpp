#include "pons/skills/fallen.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace pons::skills {
namespace {

constexpr Duration kAwaited = std::chrono::milliseconds(3500);
constexpr double kAbout_m = 0.40;                      // it may bounce, slide and roll
constexpr double kNear_m = 0.10;                       // from where it should land, mostly
constexpr int kFrames = 2;                             // in which it was seen: the first may show it still falling
constexpr int kWellSeen = 4;                           // frames that show it as it is
constexpr double kAsLarge_m = 0.015, kAsLarge = 0.06;  // two measurements of one side

// Whichever side it lies on.
bool as_large(Vector3 a, Vector3 b) {
  std::ranges::sort(a), std::ranges::sort(b);
  return ((a - b).cwiseAbs().array() <= (kAsLarge * a).cwiseMax(kAsLarge_m).array()).all();
}

bool is_larger(Vector3 seen, Vector3 than) {
  std::ranges::sort(seen), std::ranges::sort(than);
  return ((seen - than).array() > (kAsLarge * than).cwiseMax(kAsLarge_m).array()).any();
}

bool is_believed(std::uint32_t track, const std::vector<ObjectBelief>& objects) {
  return std::ranges::find(objects, track, &ObjectBelief::track) != objects.end();
}

}  // namespace

void Fallen::fell(std::string code, const Vector3& size_m, const Vector3& lands_m, double top_m,
                  const std::vector<ObjectBelief>& objects, Time now) {
  forget(code);
  Load load{.code = std::move(code), .size_m = size_m, .lands_m = lands_m, .top_m = top_m, .fell = now};
  for (const ObjectBelief& object : objects) {
    load.known.push_back(object.track);
    if (object.track != 0 && as_large(object.size_m, size_m)) load.as_large.push_back(object.track);
  }
  loads_.push_back(std::move(load));
}

void Fallen::fell_unseen(std::string code, const Vector3& size_m, const Vector3& lands_m, double top_m) {
  forget(code);
  ObjectBelief room;
  const double longest_m = size_m.maxCoeff();
  room.size_m = {longest_m + 2 * kNear_m, longest_m + 2 * kNear_m, longest_m};
  room.world_from_top.translation() = Vector3(lands_m.x(), lands_m.y(), top_m);
  unseen_.push_back({std::move(code), std::move(room)});
}

void Fallen::add_unseen(std::vector<ObjectBelief>& objects, double speed_m_s, Time now) const {
  for (const Unseen& unseen : unseen_) {
    ObjectBelief& room = objects.emplace_back(unseen.room);
    room.velocity_m_s.x() = speed_m_s;
    room.stamp = now;
  }
}

std::vector<std::pair<std::uint32_t, std::string>> Fallen::recognise(const std::vector<ObjectBelief>& objects,
                                                                     double rode_m, Time now) {
  std::erase_if(unseen_, [&](Unseen& unseen) {
    unseen.room.world_from_top.translation().x() += rode_m;
    const bool found = std::ranges::find(objects, unseen.code, &ObjectBelief::code) != objects.end();
    return found || unseen.room.world_from_top.translation().x() > belt_ends_m_;
  });
  std::vector<std::pair<std::uint32_t, std::string>> recognised;
  std::vector<Load> in_vain;
  std::erase_if(loads_, [&](Load& load) {
    load.lands_m.x() += rode_m;
    if (std::ranges::find(objects, load.code, &ObjectBelief::code) != objects.end()) return true;
    if (now > load.fell + kAwaited) {
      if (load.lands_m.x() > view_ends_m_ - kAbout_m) in_vain.push_back(load);
      return true;
    }
    const ObjectBelief* const one = only_one(load, objects);
    if (one != nullptr) recognised.emplace_back(one->track, load.code);
    if (one != nullptr) recognised_.push_back({one->track, load.code, load.size_m});
    return one != nullptr;
  });
  for (const Load& load : in_vain) fell_unseen(load.code, load.size_m, load.lands_m, load.top_m);
  return recognised;
}

std::vector<std::pair<std::uint32_t, std::string>> Fallen::take_mistaken(const std::vector<ObjectBelief>& objects) {
  std::vector<std::pair<std::uint32_t, std::string>> mistaken;
  std::erase_if(recognised_, [&](const Recognised& one) {
    const auto object = std::ranges::find(objects, one.track, &ObjectBelief::track);
    if (object == objects.end()) return true;
    const bool too_large = object->frames_seen >= kWellSeen && is_larger(object->size_m, one.size_m);
    if (too_large) mistaken.emplace_back(one.track, one.code);
    return too_large;
  });
  return mistaken;
}

const ObjectBelief* Fallen::only_one(const Load& load, const std::vector<ObjectBelief>& objects) {
  const bool all_there =
      std::ranges::all_of(load.as_large, [&](std::uint32_t track) { return is_believed(track, objects); });
  const ObjectBelief* one = nullptr;
  for (const ObjectBelief& object : objects) {
    const Vector3 off = object.world_from_top.translation() - load.lands_m;
    if (object.track == 0 || off.head<2>().norm() > kAbout_m || !as_large(object.size_m, load.size_m)) continue;
    if (std::ranges::find(load.known, object.track) != load.known.end()) continue;
    if (!all_there || one != nullptr) return nullptr;
    one = &object;
  }
  const bool unread = one != nullptr && one->code.empty() && one->disputed.empty();
  return unread && one->frames_seen >= kFrames ? one : nullptr;
}

void Fallen::forget(std::string_view code) {
  std::erase_if(unseen_, [&](const Unseen& unseen) { return unseen.code == code; });
  std::erase_if(loads_, [&](const Load& load) { return load.code == code; });
}

bool Fallen::awaits(std::string_view code) const {
  return std::ranges::find(loads_, code, &Load::code) != loads_.end();
}

}  // namespace pons::skills
