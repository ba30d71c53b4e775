#include "pons/skills/mouths.hpp"

#include <algorithm>
#include <utility>

namespace pons::skills {
namespace {

constexpr Duration kFallsWithin = std::chrono::milliseconds(1500);  // off a rim, too

bool within(const std::optional<Time>& since, Time now) { return since && now < *since + kFallsWithin; }

}  // namespace

void Mouths::expect_at(std::string_view place, Time now) {
  const auto found = std::ranges::find(world_.places, place, &world::Place::name);
  if (found != world_.places.end()) expected_[static_cast<std::size_t>(found - world_.places.begin())] = now;
}

std::vector<const world::Place*> Mouths::unexpected(const Falls& falls, Time now) {
  std::vector<const world::Place*> fell;
  const Falls before = std::exchange(last_, falls).value_or(falls);
  for (std::size_t i = 0; i < world_.places.size(); ++i) {
    const bool rides = world_.places[i].kind != world::PlaceKind::kChute;
    for (auto more = static_cast<std::uint16_t>(falls[i] - before[i]); more > 0; --more)
      if (rides || !was_expected(i, now)) fell.push_back(&world_.places[i]);
  }
  return fell;
}

// One fall each.
bool Mouths::was_expected(std::size_t place, Time now) {
  for (std::optional<Time>* const expected : {&expected_[place], &anywhere_})
    if (within(std::exchange(*expected, std::nullopt), now)) return true;
  return false;
}

}  // namespace pons::skills
