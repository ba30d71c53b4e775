#include "apps/ros_set_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/dialects/dialect.hpp"
#include "pons/core/axes.hpp"

namespace pons::apps {

Expected<void> RosSetPoints::serve(const world::Dialect& spec) {
  wishes_.emplace(gate_, spec.topic.text);
  return listen<Float64MultiArray>(gate_.node(), spec.topic,
                                   [this](const Float64MultiArray& set_point) { take(set_point); });
}

void RosSetPoints::take(const Float64MultiArray& set_point) {
  const auto& data = set_point.data;
  if (data.empty() || data.size() > kMaxAxes)
    return wishes_->refuse(Error{fmt::format("has {} values", data.size()), "data", "give one a joint, in rad"}.line());
  if (!std::ranges::all_of(data, [](double value) { return std::isfinite(value); }))
    return wishes_->refuse(Error{"is not finite", "data", "give numbers"}.line());
  wishes_->ask({{"op", "servo"}, {"positions", data}});
}

}  // namespace pons::apps
