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

std::vector<std::pair<std::string, std::function<std::uint64_t()>>> Outlets::ways_out() const {
  std::vector<std::pair<std::string, std::function<std::uint64_t()>>> named;
  for (const Sink* const sink : sinks_) {
    const bool told = std::ranges::any_of(named, [&](const auto& each) { return each.first == sink->name(); });
    if (!told && !sink->name().empty()) named.emplace_back(sink->name(), [sink] { return sink->dropped(); });
  }
  return named;
}

}  // namespace pons::apps
