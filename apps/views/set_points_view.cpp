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
  const Duration late = cell_.arm.late();
  if (!next_ || *next_ + kLatest < now) next_ = now, told_ = now - kApart - late;
  // So far nothing is replaced any more. A period that comes late leaves no gap, nor is one told twice that is slowed.
  const Time until = cell_.arm.splice_time(now);
  const std::int64_t count = std::max<std::int64_t>(0, (until - *next_ + kApart - Duration{1}) / kApart);
  const Time from = told_, to = std::max(from, *next_ + (count - 1) * kApart - late);
  for (std::int64_t i = 1; i <= count; ++i, *next_ += kApart) {
    told_ = from + (to - from) * i / count;
    const AxisVector position = cell_.arm.planned(told_ + late).position;
    message_.data.assign(position.begin(), position.end());
    commands_.put(*next_, message_);
  }
}

}  // namespace pons::apps
