// How each part fares, and figures beside that, as ROS 2 has diagnostics.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/message.hpp"
#include "pons/runner/health.hpp"
#include "pons/wire/types/diagnostic_msgs/msg/diagnostic_array.hpp"

namespace pons::apps {

class HealthView final : public View {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  struct Sources {
    std::string node, hardware;    // before each part's name; which robot or cell it is
    const runner::Health* health;  // outlives it
    // The control loops, by the robots' names: empty where there is no other.
    std::vector<std::pair<std::string, std::function<const link::State&()>>> loops;
    // Things that found no room on their way out, by who would have had them: never fewer than before.
    std::vector<std::pair<std::string, std::function<std::uint64_t()>>> dropped;
  };
  // Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<HealthView>> open(Outlets& outlets, Sources sources);
  void show(Time now) override;

 private:
  using DiagnosticArray = wire::diagnostic_msgs::msg::DiagnosticArray;
  using DiagnosticStatus = wire::diagnostic_msgs::msg::DiagnosticStatus;
  HealthView(Outlet<DiagnosticArray> diagnostics, Sources sources);
  [[nodiscard]] DiagnosticStatus status(const std::string& part) const;
  [[nodiscard]] DiagnosticStatus of_part(const std::string& part, const runner::PartHealth& health) const;
  [[nodiscard]] DiagnosticStatus of_loop(const std::string& robot, const link::State& state) const;
  [[nodiscard]] DiagnosticStatus of_way_out(std::size_t which);

  Outlet<DiagnosticArray> diagnostics_;
  Sources sources_;
  std::vector<std::uint64_t> dropped_before_;
  std::optional<Time> shown_at_;
};

}  // namespace pons::apps
