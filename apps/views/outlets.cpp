#include "apps/views/outlets.hpp"

#include <algorithm>
#include <utility>

namespace pons::apps {

Expected<std::size_t> Outlets::add(const ShownTopic& topic) {
  Places places;
  for (Sink* const sink : sinks_) {
    const auto number = sink->add(topic);
    if (!number) return std::unexpected(number.error());
    places.emplace_back(sink, *number);
  }
  topics_.push_back(std::move(places));
  return topics_.size() - 1;
}

std::vector<WayOut> Outlets::ways_out() const {
  std::vector<WayOut> ways;
  for (const Sink* const sink : sinks_) {
    const bool told = std::ranges::any_of(ways, [&](const WayOut& each) { return each.name == sink->name(); });
    if (!told) ways.push_back({std::string(sink->name()), sink->is_live(), [sink] { return sink->health(); }});
  }
  return ways;
}

}  // namespace pons::apps
