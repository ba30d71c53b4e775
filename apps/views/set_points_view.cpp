#include "apps/views/set_points_view.hpp"

#include <algorithm>

namespace pons::apps {
namespace {

constexpr Duration kLatest = std::chrono::milliseconds(200);  // what was to be told so long ago is told no more
constexpr gate::ros::Qos kCommandsQos{.depth = 100};

}  // namespace

Expected<std::unique_ptr<SetPointsView>> SetPointsView::open(Outlets& outlets, const std::string& topic,
                                                             const skills::Cell& cell) {
  auto commands = outlets.outlet<Float64MultiArray>(topic, kCommandsQos, Audience::kAll, kApart);
  if (!commands) return std::unexpected(commands.error());
  std::unique_ptr<SetPointsView> view(new SetPointsView(cell, *commands));
  const auto joints = static_cast<std::uint32_t>(cell.model.axis_names().size());
  view->message_.layout.dim = {{.label = "joints", .size = joints, .stride = joints}};
  return view;
}

void SetPointsView::show(Time now) {
  const bool goes = cell_.arm.operational() && cell_.servo != nullptr;
  if (goes) until_ = std::max(now, cell_.arm.motion_end());
  if (!goes && (now >= until_ || !cell_.arm.operational())) return next_.reset();
  if (!next_ || *next_ + kLatest < now) next_ = now;
  // So far nothing is replaced any more. A period that comes late leaves no gap.
  for (const Time until = cell_.arm.splice_time(now); *next_ < until; *next_ += kApart) {
    const AxisVector position = cell_.arm.planned(*next_).position;
    message_.data.assign(position.begin(), position.end());
    commands_.put(*next_, message_);
  }
}

}  // namespace pons::apps
