#include "pons/skills/follow_trajectory.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/skills/timed_way.hpp"

namespace pons::skills {
namespace {

using motion::TimedPoint;
using task::Json;

constexpr double kTolerance_rad = 0.01;
constexpr double kStays_s = 0.5;         // who asks for no more than where it is has it stay there for so long
constexpr double kLimitRounding = 1e-9;  // relative, of a speed that was computed from the limit

std::string number(std::size_t point) { return fmt::format("point {}", point + 1); }

// Which axis each of the names is.
Expected<std::vector<Eigen::Index>> axes_of(const std::vector<std::string>& joints,
                                            const std::vector<std::string>& names) {
  const std::string mend = fmt::format("name each of {} once", fmt::join(names, ", "));
  std::vector<Eigen::Index> axes;
  for (const std::string& joint : joints) {
    const auto found = std::ranges::find(names, joint);
    if (found == names.end()) return fail(fmt::format("the arm has no joint '{}'", joint), {}, mend);
    if (std::ranges::count(joints, joint) > 1) return fail(fmt::format("joint '{}' is named twice", joint), {}, mend);
    axes.push_back(found - names.begin());
  }
  for (const std::string& name : names) {
    if (std::ranges::find(joints, name) == joints.end())
      return fail(fmt::format("joint '{}' is missing", name), {}, mend);
  }
  return axes;
}

// Values in the order of the names to those in the order of the axes.
Expected<AxisVector> in_order(const Json& values, const std::vector<Eigen::Index>& axes, std::size_t point,
                              const char* what) {
  if (values.size() != axes.size())
    return fail(fmt::format("{} has {} {} for {} joints", number(point), values.size(), what, axes.size()), {},
                "give one a joint, in the order of their names");
  AxisVector ordered(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t i = 0; i < axes.size(); ++i) ordered[axes[i]] = values[i].get<double>();
  return ordered;
}

Expected<std::vector<TimedPoint>> points_of(const Json& arguments, const std::vector<std::string>& names) {
  const auto axes = axes_of(arguments.at("joints").get<std::vector<std::string>>(), names);
  if (!axes) return std::unexpected(axes.error());
  std::vector<TimedPoint> points;
  for (const Json& given : arguments.at("points")) {
    const std::size_t k = points.size();
    const auto position = in_order(given.at("positions"), *axes, k, "positions");
    if (!position) return std::unexpected(position.error());
    TimedPoint& point = points.emplace_back(given.at("time_s").get<double>(), *position);
    if (!given.contains("velocities")) continue;
    const auto speed = in_order(given.at("velocities"), *axes, k, "velocities");
    if (!speed) return std::unexpected(speed.error());
    point.speed = *speed;
  }
  return points;
}

Expected<void> check_limits(const std::vector<TimedPoint>& points, const std::vector<std::string>& names,
                            const AxisLimits& limits) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    for (Eigen::Index i = 0; i < points[k].position.size(); ++i) {
      const std::string& name = names[static_cast<std::size_t>(i)];
      const double q = points[k].position[i];
      if (!(q >= limits.position_min[i]) || !(q <= limits.position_max[i]))
        return fail(fmt::format("{}: {} at {:.4f} rad is outside its limits, {:.4f} to {:.4f} rad", number(k), name, q,
                                limits.position_min[i], limits.position_max[i]),
                    {}, "keep inside");
      if (!points[k].speed) continue;
      const double speed = (*points[k].speed)[i];
      if (!(std::abs(speed) <= limits.speed_rad_s[i] * (1 + kLimitRounding)))
        return fail(fmt::format("{}: {} with {:.4f} rad/s is beyond its limit, {:.4f} rad/s", number(k), name, speed,
                                limits.speed_rad_s[i]),
                    {}, "pass it more slowly");
    }
  }
  if (points.front().time_s == 0 && points.front().speed && !points.front().speed->isZero(0))
    return fail("point 1 is where it begins, and has a speed", {}, "begin at rest");
  if (points.back().speed && !points.back().speed->isZero(0))
    return fail(fmt::format("{} is the last, and has a speed", number(points.size() - 1)), {}, "end at rest");
  return {};
}

// From one point to the next at the speed limit: no motion is quicker, whatever comes before and after.
Expected<void> check_legs(const std::vector<TimedPoint>& points, const std::vector<std::string>& names,
                          const AxisLimits& limits) {
  for (std::size_t k = 1; k < points.size(); ++k) {
    Eigen::Index axis = 0;
    const AxisVector turn = (points[k].position - points[k - 1].position).cwiseAbs();
    const double least_s = turn.cwiseQuotient(limits.speed_rad_s).maxCoeff(&axis);
    const double given_s = points[k].time_s - points[k - 1].time_s;
    if (least_s <= given_s) continue;
    return fail(fmt::format("{}: {} turns {:.3f} rad in {:.3f} s, which takes {:.3f} s at its speed limit alone",
                            number(k), names[static_cast<std::size_t>(axis)], turn[axis], given_s, least_s),
                {}, fmt::format("reach it after {:.3f} s or later", points[k - 1].time_s + least_s));
  }
  return {};
}

// All that can be said of it before the arm is where it begins.
Expected<std::vector<TimedPoint>> read(Cell& cell, const Json& arguments) {
  const std::vector<std::string> names = cell.model.axis_names();
  auto points = points_of(arguments, names);
  if (!points) return points;
  const bool begins = points->front().time_s == 0;
  if (begins && points->size() == 1) points->push_back({kStays_s, points->front().position, std::nullopt});
  AxisLimits limits = cell.limits_planned();
  // Where it may take longer, only the whole of it tells how much that is.
  if (arguments.contains(kTimeTolerance)) limits.speed_rad_s.setConstant(std::numeric_limits<double>::infinity());
  Expected<void> good = check_times(*points, begins ? 1 : 0);
  if (good) good = check_limits(*points, names, limits);
  if (good) good = check_legs(*points, names, limits);
  for (std::size_t k = 0; good && k < points->size(); ++k)
    good = cell.reach.stands_free((*points)[k].position, number(k));
  if (!good) return std::unexpected(good.error());
  return points;
}

Expected<TimedWay> way_of(Cell& cell, const Json& arguments) {
  auto points = read(cell, arguments);
  if (!points) return std::unexpected(points.error());
  const double tolerance_rad = arguments.value("goal_tolerance", kTolerance_rad);
  std::optional<AxisVector> begins;
  if (points->front().time_s == 0) {
    begins = points->front().position;
    points->erase(points->begin());
  }
  return TimedWay{
      .points = *std::move(points),
      .begins = std::move(begins),
      .path_tolerance_rad = arguments.value("path_tolerance", std::numeric_limits<double>::infinity()),
      .make =
          [](const AxisVector& start, std::span<const TimedPoint> through) {
            return motion::move_in_time(start, Time{}, through, motion::Shape::kBetween);
          },
      .arrived = [&cell, tolerance_rad](const AxisVector& measured, const AxisVector& planned) -> Expected<void> {
        Eigen::Index axis = 0;
        const double off = (measured - planned).cwiseAbs().maxCoeff(&axis);
        if (off <= tolerance_rad) return {};
        return fail(fmt::format("{} is {:.4f} rad off the last point, of which {:.4f} are allowed",
                                cell.model.axis_names()[static_cast<std::size_t>(axis)], off, tolerance_rad));
      }};
}

Json schema() {
  const auto numbers = [] { return Json{{"type", "array"}, {"items", {{"type", "number"}}}, {"maxItems", kMaxAxes}}; };
  const Json tolerance{{"type", "number"}, {"minimum", 0.0001}, {"maximum", 0.5}};
  const Json point{
      {"type", "object"},
      {"properties", {{"positions", numbers()}, {"velocities", numbers()}, {"time_s", {{"type", "number"}}}}},
      {"required", {"positions", "time_s"}},
      {"additionalProperties", false}};
  return {{"type", "object"},
          {"properties",
           {{"joints",
             {{"type", "array"},
              {"items", {{"type", "string"}, {"maxLength", 64}}},
              {"minItems", 1},
              {"maxItems", kMaxAxes}}},
            {"points", {{"type", "array"}, {"items", point}, {"minItems", 1}, {"maxItems", kMostTrajectoryPoints}}},
            {"goal_tolerance", tolerance},
            {"path_tolerance", tolerance}}},
          {"required", {"joints", "points"}},
          {"additionalProperties", false}};
}

}  // namespace

task::SkillType follow_trajectory(Cell& cell) {
  return timed_skill(cell,
                     {"follow_trajectory", "Move the joints through given positions at given times", schema(), way_of});
}

}  // namespace pons::skills
