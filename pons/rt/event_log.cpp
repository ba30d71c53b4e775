#include "pons/rt/event_log.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

namespace pons::rt {

void EventLog::drain(const std::function<void(Time, std::string_view)>& say) {
  Event event;
  while (events_.pop(event)) {
    fmt::dynamic_format_arg_store<fmt::format_context> values;
    for (std::size_t i = 0; i < event.count; ++i)
      std::visit([&](const auto& value) { values.push_back(value); }, event.values[i]);
    say(event.at, fmt::vformat({event.format.data(), event.format.size()}, values));
    latest_ = event.at;
  }
  if (const std::uint64_t dropped = dropped_.exchange(0, std::memory_order_relaxed); dropped > 0)
    say(latest_, fmt::format("{} more events did not fit into the log", dropped));
}

}  // namespace pons::rt
