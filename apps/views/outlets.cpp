#include "apps/views/outlets.hpp"

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

}  // namespace pons::apps
