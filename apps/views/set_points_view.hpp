// What an arm is asked for while it goes after set-points: its joints, 500 times a second, in time for others to do the
// same. The dialect `set_points` is answered with it.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "apps/views/outlets.hpp"
#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/skills/cell.hpp"
#include "pons/wire/types/std_msgs/msg/float64_multi_array.hpp"

namespace pons::apps {

class SetPointsView final : public View {
 public:
  static constexpr Duration kApart = std::chrono::milliseconds(2);
  // `cell` outlives it. Errors: those of the outlets.
  [[nodiscard]] static Expected<std::unique_ptr<SetPointsView>> open(Outlets& outlets, const std::string& topic,
                                                                     const skills::Cell& cell);
  void show(Time now) override;

 private:
  using Float64MultiArray = wire::std_msgs::msg::Float64MultiArray;
  SetPointsView(const skills::Cell& cell, Outlet<Float64MultiArray> commands) : cell_(cell), commands_(commands) {}

  const skills::Cell& cell_;
  Outlet<Float64MultiArray> commands_;
  Float64MultiArray message_;
  std::optional<Time> next_;  // when another one is told, while any are
  Time told_;                 // of the last one, in the motion's time, which a zone makes slower
  Time until_;                // so long at least
};

}  // namespace pons::apps
