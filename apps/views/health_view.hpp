// How each part fares, and figures beside that, as ROS 2 has diagnostics: one message of the run itself, and one, which
// no recording has, of those who look on.
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
  // For so long a finding is a warning. Whether what was found still is so nobody tells; how many there were, and the
  // newest, it says as long as the run lasts.
  static constexpr Duration kFoundFor = std::chrono::minutes(1);

  struct Sources {
    std::string node, hardware;    // before each part's name; which robot or cell it is
    const runner::Health* health;  // outlives it
    // The control loops, by the robots' names: empty where there is no other.
    std::vector<std::pair<std::string, std::function<const link::State&()>>> loops;
    std::vector<WayOut> ways_out;
  };
  // Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<HealthView>> open(Outlets& outlets, Sources sources);
  void show(Time now) override;

 private:
  using DiagnosticArray = wire::diagnostic_msgs::msg::DiagnosticArray;
  using DiagnosticStatus = wire::diagnostic_msgs::msg::DiagnosticStatus;
  HealthView(Outlet<DiagnosticArray> diagnostics, Outlet<DiagnosticArray> live, Sources sources);
  [[nodiscard]] DiagnosticStatus status(const std::string& part) const;
  [[nodiscard]] DiagnosticStatus of_part(const std::string& part, const runner::PartHealth& health) const;
  [[nodiscard]] DiagnosticStatus of_loop(const std::string& robot, const link::State& state) const;
  // As it was when it was last shown, and when it was last seen that there was one finding more.
  struct Before {
    SinkHealth health;
    std::optional<Time> found_at;
  };
  [[nodiscard]] DiagnosticStatus of_way_out(const WayOut& way, Before& before, Time now) const;

  Outlet<DiagnosticArray> diagnostics_, live_;
  Sources sources_;
  std::vector<Before> before_;  // as Sources::ways_out
  std::optional<Time> shown_at_;
};

}  // namespace pons::apps
