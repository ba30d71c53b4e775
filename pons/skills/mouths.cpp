#include "pons/skills/mouths.hpp"

#include <algorithm>
#include <utility>

namespace pons::skills {
namespace {

constexpr Duration kFallsWithin = std::chrono::milliseconds(1500);  // off a rim, too

}  // namespace

void Mouths::expect_at(std::string_view place, const std::string& code, Time now) {
  const auto found = std::ranges::find(world_.places, place, &world::Place::name);
  if (found == world_.places.end() || found->kind != world::PlaceKind::kChute) return;
  expected_[static_cast<std::size_t>(found - world_.places.begin())] = Load{code, now};
}

std::vector<const world::Place*> Mouths::unexpected(const Falls& falls, Time now) {
  std::vector<const world::Place*> fell;
  const Falls before = std::exchange(last_, falls).value_or(falls);
  for (std::size_t i = 0; i < world_.places.size(); ++i) {
    const bool rides = world_.places[i].kind != world::PlaceKind::kChute;
    if (falls[i] != before[i]) counted_[i] = now;
    for (auto more = static_cast<std::uint16_t>(falls[i] - before[i]); more > 0; --more)
      if (rides || !was_expected(i, now)) fell.push_back(&world_.places[i]);
  }
  return fell;
}

std::vector<const world::Place*> Mouths::fallen_since(const Falls& before) const {
  const auto index = [&](const world::Place& place) { return static_cast<std::size_t>(&place - world_.places.data()); };
  std::vector<const world::Place*> chutes;
  for (const world::Place& place : world_.places)
    if (place.kind == world::PlaceKind::kChute && last_ && (*last_)[index(place)] != before[index(place)])
      chutes.push_back(&place);
  std::ranges::stable_sort(chutes, {}, [&](const world::Place* place) { return counted_[index(*place)]; });
  return chutes;
}

// One fall each.
bool Mouths::was_expected(std::size_t place, Time now) {
  const std::optional<Load> load = std::exchange(expected_[place], std::nullopt);
  if (load && now < load->let_go + kFallsWithin) return true;
  const std::optional<Time> lost = std::exchange(anywhere_, std::nullopt);
  return lost && now < *lost + kFallsWithin;
}

std::vector<Mouths::Load> Mouths::take_uncounted(Time now) {
  std::vector<Load> uncounted;
  for (std::optional<Load>& load : expected_)
    if (load && now >= load->let_go + kFallsWithin) uncounted.push_back(*std::exchange(load, std::nullopt));
  return uncounted;
}

}  // namespace pons::skills
