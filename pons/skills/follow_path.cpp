#include "pons/skills/follow_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pons/motion/track.hpp"
#include "pons/skills/grasp.hpp"
#include "pons/skills/timed_way.hpp"

namespace pons::skills {
namespace {

using motion::TimedPoint;
using task::Json;

constexpr double kTolerance_m = 0.005;
constexpr double kKnot_s = 0.02;                              // between joint angles, at least,
constexpr int kFewestKnots = 4, kMostKnots = 24, kAll = 224;  // a leg's, and all of them: what the loop can queue
constexpr double kOff_m = 0.001, kOff_rad = 0.01;             // between them

std::string number(std::size_t point) { return fmt::format("point {}", point + 1); }

// Where the tip is to be, and how it is turned.
class TipWay {
 public:
  TipWay(const Pose& from, double first_s, const motion::Trajectory& places)
      : places_(places),
        first_s_(first_s),
        from_(from.linear()),
        down_(Cell::tip_down(Vector3::Zero(), yaw_of(from.linear())).linear()) {}

  [[nodiscard]] Pose at(double t_s) const {
    Pose pose = Pose::Identity();
    const double share = std::clamp(t_s / first_s_, 0.0, 1.0);
    const double smooth = share * share * share * (10 + share * (6 * share - 15));
    pose.linear() = from_.slerp(smooth, down_).toRotationMatrix();
    pose.translation() = motion::sample(places_, Time(from_s(t_s)), 3).position;
    return pose;
  }

 private:
  const motion::Trajectory& places_;
  double first_s_;  // by when it points down
  Eigen::Quaterniond from_, down_;
};

// Joint angles along the tip's way, close enough together for a spline.
Expected<std::vector<TimedPoint>> knots_of(const model::RobotModel& model, const AxisVector& start, const TipWay& tip,
                                           std::span<const TimedPoint> points) {
  std::vector<TimedPoint> knots;
  AxisVector q = start;
  double before_s = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const double leg_s = points[k].time_s - before_s;
    const int most = std::clamp(kAll / static_cast<int>(points.size()), kFewestKnots, kMostKnots);
    const int count = std::clamp(static_cast<int>(leg_s / kKnot_s), 1, most);
    for (int i = 1; i <= count; ++i) {
      const double t_s = before_s + leg_s * i / count;
      auto next = motion::angles_near(model, tip.at(t_s), q);
      if (!next)
        return fail(
            fmt::format("{} s on the way, to {}, the tip is out of reach, or an axis at its limit", t_s, number(k)), {},
            "lead it nearer, or set out from elsewhere");
      q = *next;
      knots.push_back({t_s, q, {}});
    }
    before_s = points[k].time_s;
  }
  return knots;
}

// Between the knots, too.
Expected<void> check_way(model::RobotModel& model, const motion::Trajectory& way, const TipWay& tip) {
  for (const Segment& segment : way) {
    const double t_s = to_s(segment.start - Time{}) + 0.5 * to_s(segment.duration);
    const Pose is = model.world_from_tip(motion::sample(way, Time(from_s(t_s)), model.axes()).position);
    const Pose should = tip.at(t_s);
    const double off_m = (is.translation() - should.translation()).norm();
    const double off_rad = std::abs(Eigen::AngleAxisd(is.linear().transpose() * should.linear()).angle());
    if (off_m <= kOff_m && off_rad <= kOff_rad) continue;
    return fail(fmt::format("{:.2f} s on the way the joints cannot follow the tip: it would be {:.1f} mm beside it",
                            t_s, 1e3 * off_m),
                {}, "pass farther beside the arm's axes, or give more points");
  }
  return {};
}

Expected<motion::Trajectory> make(Cell& cell, const AxisVector& start, std::span<const TimedPoint> points) {
  const Pose from = cell.model.world_from_tip(start);
  const AxisVector place = from.translation();
  const auto places = motion::move_in_time(place, Time{}, points, motion::Shape::kBetween);
  if (!places) return places;
  const TipWay tip(from, points.front().time_s, *places);
  const auto knots = knots_of(cell.model, start, tip, points);
  if (!knots) return std::unexpected(knots.error());
  auto way = motion::move_in_time(start, Time{}, *knots, motion::Shape::kSmooth);
  if (!way) return way;
  if (auto good = check_way(cell.model, *way, tip); !good) return std::unexpected(good.error());
  return way;
}

Expected<std::vector<TimedPoint>> read(Cell& cell, const Json& arguments) {
  std::vector<TimedPoint> points;
  for (const Json& given : arguments.at("points")) {
    const auto xyz = given.at("position").get<std::vector<double>>();
    points.push_back({given.at("time_s").get<double>(), AxisVector(Vector3(xyz.at(0), xyz.at(1), xyz.at(2))), {}});
  }
  if (auto good = check_times(points); !good) return std::unexpected(good.error());
  for (std::size_t k = 0; k < points.size(); ++k) {
    const auto posture = cell.reach.posture(points[k].position, number(k));
    if (!posture) return std::unexpected(posture.error());
  }
  return points;
}

Expected<TimedWay> way_of(Cell& cell, const Json& arguments) {
  auto points = read(cell, arguments);
  if (!points) return std::unexpected(points.error());
  const double tolerance_m = arguments.value("goal_tolerance", kTolerance_m);
  return TimedWay{
      .points = *std::move(points),
      .make = [&cell](const AxisVector& start,
                      std::span<const TimedPoint> through) { return make(cell, start, through); },
      .arrived = [&cell, tolerance_m](const AxisVector& measured, const AxisVector& planned) -> Expected<void> {
        const Vector3 is = cell.model.world_from_tip(measured).translation();
        const double off_m = (is - cell.model.world_from_tip(planned).translation()).norm();
        if (off_m <= tolerance_m) return {};
        return fail(fmt::format("the tip is {:.1f} mm off the last point, of which {:.1f} are allowed", 1e3 * off_m,
                                1e3 * tolerance_m));
      }};
}

Json schema() {
  const Json xyz{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
  const Json point{{"type", "object"},
                   {"properties", {{"position", xyz}, {"time_s", {{"type", "number"}}}}},
                   {"required", {"position", "time_s"}},
                   {"additionalProperties", false}};
  return {{"type", "object"},
          {"properties",
           {{"points", {{"type", "array"}, {"items", point}, {"minItems", 1}, {"maxItems", kMostPathPoints}}},
            {"goal_tolerance", {{"type", "number"}, {"minimum", 0.0005}, {"maximum", 0.1}}}}},
          {"required", {"points"}},
          {"additionalProperties", false}};
}

}  // namespace

task::SkillType follow_path(Cell& cell) {
  return timed_skill(cell, {"follow_path", "Move the tool tip through given places at given times", schema(), way_of});
}

}  // namespace pons::skills
