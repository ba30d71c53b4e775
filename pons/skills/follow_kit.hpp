// For the tests of the skills that go through points at given times.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/skills/skills.hpp"
#include "pons/skills/test_kit.hpp"

namespace pons::skills {

inline constexpr const char* kTrajectory = "follow_trajectory";
inline constexpr const char* kPath = "follow_path";

class FollowKit : public ObedientArmTest {
 protected:
  explicit FollowKit(world::World world = parcel_cell()) : ObedientArmTest(std::move(world)) {
    opened_ = true;
    add_skills(registry_, cell_, {});
    pass();
  }

  [[nodiscard]] AxisVector home(const std::vector<std::pair<int, double>>& turned = {}) const {
    AxisVector q = world_.robot.home;
    for (const auto& [axis, by] : turned) q[axis] += by;
    return q;
  }
  // Names in reverse, so that their order counts.
  [[nodiscard]] task::Json joints() const {
    std::vector<std::string> names = cell_.model.axis_names();
    std::ranges::reverse(names);
    return names;
  }
  [[nodiscard]] static task::Json values(const AxisVector& q) {
    std::vector<double> reversed(q.begin(), q.end());
    std::ranges::reverse(reversed);
    return reversed;
  }
  [[nodiscard]] task::Json trajectory(const std::vector<std::pair<double, AxisVector>>& points) const {
    task::Json arguments{{"joints", joints()}, {"points", task::Json::array()}};
    for (const auto& [time_s, q] : points)
      arguments["points"].push_back({{"positions", values(q)}, {"time_s", time_s}});
    return arguments;
  }
  [[nodiscard]] static task::Json path(const std::vector<std::pair<double, Vector3>>& points) {
    task::Json arguments{{"points", task::Json::array()}};
    for (const auto& [time_s, p] : points)
      arguments["points"].push_back({{"position", {p.x(), p.y(), p.z()}}, {"time_s", time_s}});
    return arguments;
  }
  std::string refusal(const char* skill, const task::Json& arguments) {
    const auto good = registry_.find(skill)->feasible(arguments, task::Moment::kAdmission);
    return good ? "" : good.error().line();
  }

  // Ticks it to its end, `meanwhile` with the time since it set out.
  task::Progress run(const char* skill, const task::Json& arguments,
                     const std::function<void(double)>& meanwhile = {}) {
    skill_ = registry_.find(skill)->start(arguments, now_);
    set_out_.reset();
    for (int tick = 0; tick < 6000; ++tick) {
      task::Progress progress = skill_->tick(now_);
      for (const task::Note& note : progress.notes)
        if (note.kind == "plan" && !set_out_) set_out_ = cell_.arm.splice_time(now_);
      if (task::is_end(progress.status)) return progress;
      pass();
      for (link::Command heard; link::CerebellumEnd(*link_).receive(heard);) continue;
      if (off_rad_ > 0) measured_off();
      if (meanwhile && set_out_) meanwhile(to_s(now_ - *set_out_));
    }
    ADD_FAILURE() << "it does not end";
    return {};
  }
  // Axis 1 is measured beside what is asked of it.
  void measured_off() {
    link::State state = cell_.arm.state();
    state.position[1] += off_rad_;
    link::CerebellumEnd(*link_).publish(state);
    cell_.arm.refresh(now_);
  }
  [[nodiscard]] double off(const AxisVector& q) const { return (cell_.arm.state().position - q).cwiseAbs().maxCoeff(); }

  task::SkillRegistry registry_;
  std::unique_ptr<task::Skill> skill_;
  std::optional<Time> set_out_;
  double off_rad_ = 0;
};

}  // namespace pons::skills
