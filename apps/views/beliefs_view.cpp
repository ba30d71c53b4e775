#include "apps/views/beliefs_view.hpp"

#include <Eigen/Geometry>

#include <string>
#include <utility>

#include "apps/views/frames.hpp"
#include "pons/gate/ros/action.hpp"

namespace pons::apps {
namespace {

using gate::ros::ros_stamp;
using wire::pons_msgs::msg::ObjectBelief;

ObjectBelief message_of(const pons::ObjectBelief& belief) {
  ObjectBelief message;
  const Vector3 at = belief.world_from_top.translation();
  const Eigen::Quaterniond turn(belief.world_from_top.linear());
  message.track = belief.track;
  message.pose.position = {at.x(), at.y(), at.z()};
  message.pose.orientation = {turn.x(), turn.y(), turn.z(), turn.w()};
  message.size = {belief.size_m.x(), belief.size_m.y(), belief.size_m.z()};
  message.position_sigma = belief.position_sigma_m;
  message.yaw_sigma = belief.yaw_sigma_rad;
  message.confidence = belief.confidence;
  message.flatness = belief.flatness_m;
  message.frames_seen = belief.frames_seen;
  message.last_seen = ros_stamp(belief.last_seen.ns());
  message.crowded = belief.crowded;
  message.code = belief.code;
  message.disputed = belief.disputed;
  message.label_attempts = belief.label_attempts;
  return message;
}

void put(const std::vector<pons::ObjectBelief>& from, std::vector<ObjectBelief>& to) {
  to.clear();
  for (const pons::ObjectBelief& each : from) to.push_back(message_of(each));
}

}  // namespace

Expected<std::unique_ptr<BeliefsView>> BeliefsView::open(Outlets& outlets,
                                                         std::function<const runner::Snapshot&()> seen) {
  auto beliefs = outlets.outlet<Beliefs>("~/beliefs");
  if (!beliefs) return std::unexpected(beliefs.error());
  return std::unique_ptr<BeliefsView>(new BeliefsView(*beliefs, std::move(seen)));
}

void BeliefsView::show(Time now) {
  const runner::Snapshot& seen = seen_();
  // Two cameras may have taken theirs at the same moment.
  if (seen.stamp == stamp_ && seen.due == due_) return;
  stamp_ = seen.stamp;
  due_ = seen.due;
  if (!beliefs_.wanted()) return;
  message_.header.stamp = ros_stamp(seen.stamp.ns());
  message_.header.frame_id = std::string(kWorldFrame);
  message_.belt_travel = seen.belt_travel_m;
  put(seen.objects, message_.objects);
  put(seen.cut, message_.cut);
  beliefs_.put(now, message_);
}

}  // namespace pons::apps
