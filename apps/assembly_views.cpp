// What a cell shows, and to whom: the views of its bridge's half.
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "apps/assembly.hpp"
#include "apps/views/arms_view.hpp"
#include "apps/views/beliefs_view.hpp"
#include "apps/views/clock_view.hpp"
#include "apps/views/frames.hpp"
#include "apps/views/link_view.hpp"
#include "apps/views/low_level_view.hpp"
#include "apps/views/set_points_view.hpp"

namespace pons::apps {

// To whom it shows itself, and by whom it is asked as a node of ROS 2.
Expected<void> BridgeHalf::open_sinks(const world::World& world, const BridgeOptions& options) {
  if (options.ros) {
    auto node = RosNode::open(*options.ros);
    if (!node) return std::unexpected(node.error());
    ros = std::move(*node);
    if (auto served = ros->serve_parameters(world.name); !served) return served;
    if (auto connected = ros->connect(outside); !connected) return connected;
    if (auto speaks = ros->speak(world.dialects, arms.front()->registry); !speaks) return speaks;
    // Of several arms no task says which it means.
    if (arms.size() == 1) {
      if (auto served = ros->serve_arm(cell().model.axis_names(), world.outside_skills); !served) return served;
    }
    outlets.add(*ros);
  }
  for (Sink* const sink : options.sinks) outlets.add(*sink);
  return {};
}

// What it shows, to all who are there by now.
Expected<void> BridgeHalf::open_views(const world::World& world, const BridgeOptions& options) {
  std::vector<ShownRobot> shown;
  const auto stations = world.arms();
  for (std::size_t i = 0; i < arms.size(); ++i)
    shown.push_back({arms.size() > 1 ? stations[i].arm : std::string(), arms[i]->cell.model.copy(),
                     [&cell = arms[i]->cell]() -> const link::State& { return cell.arm.state(); }});
  auto robots = ArmsView::open(outlets, std::move(shown), {.transforms = cameras->frames()});
  if (!robots) return std::unexpected(robots.error());
  views.push_back(std::move(*robots));
  auto clock = ClockView::open(outlets);
  if (!clock) return std::unexpected(clock.error());
  views.push_back(std::move(*clock));
  if (auto seen = open_inner_views(world); !seen) return seen;
  const gate::ros::NodeName name = options.ros ? options.ros->name : gate::ros::NodeName{"/", "pons"};
  auto run = RunViews::open(outlets, *bridge, name, health_sources(world, name));
  if (!run) return std::unexpected(run.error());
  run_views_ = run->get();
  views.push_back(std::move(*run));
  return {};
}

// What it believes, and what crosses the link.
Expected<void> BridgeHalf::open_inner_views(const world::World& world) {
  auto beliefs =
      BeliefsView::open(outlets, [side = bridge_side.get()]() -> const runner::Snapshot& { return side->seen(); });
  if (!beliefs) return std::unexpected(beliefs.error());
  views.push_back(std::move(*beliefs));
  std::vector<LinkView::Robot> robots;
  std::vector<LowLevelView::Robot> moved;
  for (std::size_t robot = 0; robot < arms.size(); ++robot)
    moved.push_back({arms.size() > 1 ? arms[robot]->cell.world.arm : std::string(), &arms[robot]->cell.arm,
                     arms[robot]->cell.model.copy(), [half = bridge.get(), robot] { return half->mover(robot); }});
  auto commands = LowLevelView::open(outlets, std::move(moved));
  if (!commands) return std::unexpected(commands.error());
  views.push_back(std::move(*commands));
  const auto set_points = std::ranges::find(world.dialects, world::Dialect::Kind::kSetPoints, &world::Dialect::kind);
  if (set_points != world.dialects.end()) {
    auto asked = SetPointsView::open(outlets, set_points->feedback.text, cell());
    if (!asked) return std::unexpected(asked.error());
    views.push_back(std::move(*asked));
  }
  for (const auto& arm : arms) {
    const world::Robot& robot = arm->cell.world.robot;
    robots.push_back({.name = arms.size() > 1 ? arm->cell.world.arm : std::string(),
                      .hand = &arm->cell.arm,
                      .frame = std::string(kWorldFrame),
                      .axes = static_cast<std::size_t>(robot.home.size()),
                      .cups = robot.tool.cups_m.size()});
  }
  auto links = LinkView::open(outlets, std::move(robots));
  if (!links) return std::unexpected(links.error());
  views.push_back(std::move(*links));
  return {};
}

HealthView::Sources BridgeHalf::health_sources(const world::World& world, const gate::ros::NodeName& name) {
  HealthView::Sources sources{.node = name.name,
                              .hardware = world.name,
                              .health = &bridge_side->health(),
                              .loops = {},
                              .ways_out = outlets.ways_out()};
  for (const auto& arm : arms)
    sources.loops.emplace_back(arms.size() > 1 ? arm->cell.world.arm : std::string(),
                               [&cell = arm->cell]() -> const link::State& { return cell.arm.state(); });
  if (cameras)
    sources.ways_out.push_back(
        {.name = "pictures", .health = [made = cameras.get()] { return SinkHealth{.dropped = made->left_out()}; }});
  return sources;
}

}  // namespace pons::apps
