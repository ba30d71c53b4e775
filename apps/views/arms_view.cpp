#include "apps/views/arms_view.hpp"

#include <string>
#include <string_view>
#include <utility>

#include "apps/views/frames.hpp"

namespace pons::apps {
namespace {

constexpr std::string_view kTipFrame = "tool_tip";

}  // namespace

Expected<std::unique_ptr<ArmsView>> ArmsView::open(Outlets& outlets, std::vector<ShownRobot> arms,
                                                   Transforms standing) {
  auto transforms = outlets.outlet<Transforms>("/tf", kTransformsQos);
  auto fixed = outlets.outlet<Transforms>("/tf_static", gate::ros::kLatchedQos);
  if (!transforms) return std::unexpected(transforms.error());
  if (!fixed) return std::unexpected(fixed.error());
  std::unique_ptr<ArmsView> view(new ArmsView(*transforms));
  for (ShownRobot& arm : arms) {
    if (auto added = view->add(outlets, std::move(arm), standing); !added) return std::unexpected(added.error());
  }
  fixed->put(Time{}, standing);
  return view;
}

Expected<void> ArmsView::add(Outlets& outlets, ShownRobot arm, Transforms& standing) {
  auto links = RobotLinks::open(outlets, std::move(arm), standing);
  if (!links) return std::unexpected(links.error());
  const std::string& name = links->robot().name;
  const world::Robot& file = links->robot().model.robot();
  if (const std::string root = links->root(); !root.empty())
    standing.transforms.push_back(transform(file.world_from_base, std::string(kWorldFrame), root));
  if (!file.flange_link.empty())
    standing.transforms.push_back(
        transform(file.tool.flange_from_tip, frame(name, file.flange_link), frame(name, kTipFrame)));
  arms_.push_back(*std::move(links));
  return {};
}

void ArmsView::show(Time now) {
  moving_.transforms.clear();
  bool any = false;
  for (RobotLinks& arm : arms_) any = arm.show(now, moving_) || any;
  if (any) transforms_.put(now, moving_);
}

}  // namespace pons::apps
