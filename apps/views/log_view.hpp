// What a run tells people, a line each, as ROS 2 logs it: /rosout. All such lines go through here: of the journal those
// that tell of the robot, of its parts and of tasks that went wrong, and whatever say() is told.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "apps/views/journal_tail.hpp"
#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/wire/types/rcl_interfaces/msg/log.hpp"

namespace pons::apps {

class LogView final {
 public:
  using Log = wire::rcl_interfaces::msg::Log;

  // `logger` is what the node's lines are known by: "pons", "hall.cell". It hears by `tail`, which it outlives. Errors:
  // those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<LogView>> open(Outlets& outlets, JournalTail& tail, std::string logger);

  // On the bridge's thread. `level` is one of Log's; a line feed at the end of the line is left out.
  void say(std::uint8_t level, Time at, std::string_view line);

 private:
  LogView(Outlet<Log> lines, std::string logger) : lines_(lines), logger_(std::move(logger)) {}
  void hear(const bridge::Event& event);

  Outlet<Log> lines_;
  std::string logger_;
};

}  // namespace pons::apps
