// The dialect `motion`: places of the tool tip and when it shall be there, answered by how far it has come.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "apps/dialects/dialect.hpp"
#include "pons/gate/ros/action.hpp"
#include "pons/task/json_text.hpp"
#include "pons/task/json_value.hpp"
#include "pons/wire/json.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_status.hpp"
#include "pons/wire/types/cerebellum_interface/msg/motion_trajectory.hpp"

namespace pons::apps {
namespace {

using task::Json;
using wire::cerebellum_interface::msg::MotionStatus;
using wire::cerebellum_interface::msg::MotionTrajectory;

constexpr const char* kFrame = "world";
constexpr const char* kProgressEvent = "progress";  // of the skill: {"share": of the way, 0 to 1, …}

double seconds(const wire::builtin_interfaces::msg::Duration& duration) {
  return duration.sec + 1e-9 * duration.nanosec;
}

Expected<Json> asked_by(const MotionTrajectory& trajectory) {
  if (const std::string& frame = trajectory.header.frame_id; !frame.empty() && frame != kFrame)
    return fail(fmt::format("the frame '{}' is not known here", task::excerpt(frame)), "header.frame_id",
                "give waypoints in the frame world");
  if (trajectory.waypoints.size() != trajectory.time_from_start.size())
    return fail(
        fmt::format("{} waypoints and {} times", trajectory.waypoints.size(), trajectory.time_from_start.size()),
        "time_from_start", "give each waypoint its time");
  Json points = Json::array();
  for (std::size_t i = 0; i < trajectory.waypoints.size(); ++i) {
    const auto& at = trajectory.waypoints[i];
    if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z))
      return fail("is not finite", fmt::format("waypoints[{}]", i), "write three numbers, in m");
    points.push_back({{"position", {at.x, at.y, at.z}}, {"time_s", seconds(trajectory.time_from_start[i])}});
  }
  return Json{{"steps", Json::array({{{"skill", kMotionSkill}, {"arguments", {{"points", std::move(points)}}}}})}};
}

class Motion final : public Dialect {
 public:
  explicit Motion(world::Dialect spec) : spec_(std::move(spec)) {}

  [[nodiscard]] Expected<void> open(gate::ros::Node& node, Hears hears) override {
    auto status = speak_at<MotionStatus>(node, spec_.feedback);
    if (!status) return std::unexpected(status.error());
    status_.emplace(std::move(*status));
    return listen<MotionTrajectory>(node, spec_.topic, [hears = std::move(hears)](const MotionTrajectory& trajectory) {
      hears({.id = trajectory.trajectory_id, .asked = asked_by(trajectory), .heard = wire::to_json(trajectory)});
    });
  }

  void tell(const Saying& saying) override {
    using State = Saying::State;
    const bool comes_on = task::text_of(saying.event, "kind") == kProgressEvent;
    if (!comes_on && !is_course(saying)) return;
    if (comes_on) shares_[saying.id] = saying.event.at("detail").value("share", 0.0F);
    const bool goes_on = saying.state == State::kAccepted || saying.state == State::kExecuting;
    const auto share = shares_.find(saying.id);
    MotionStatus status{.trajectory_id = saying.id,
                        .motion_status = goes_on                             ? "RUNNING"
                                         : saying.state == State::kSucceeded ? "DONE"
                                                                             : "ERROR",
                        .progress = share == shares_.end() ? 0 : share->second};
    status.header = {.stamp = gate::ros::ros_stamp(saying.stamp.ns()), .frame_id = kFrame};
    if (saying.state == State::kSucceeded) status.progress = 1;
    (void)status_->publish(status);
    // Of a message that is refused the task, if there is one, goes on.
    if (saying.state == State::kSucceeded || saying.state == State::kFailed) shares_.erase(saying.id);
  }

 private:
  world::Dialect spec_;
  std::map<std::string, float, std::less<>> shares_;  // of those that go on, how far they have come
  std::optional<gate::ros::Publisher<MotionStatus>> status_;
};

}  // namespace

std::unique_ptr<Dialect> motion(const world::Dialect& spec) { return std::make_unique<Motion>(spec); }

}  // namespace pons::apps
