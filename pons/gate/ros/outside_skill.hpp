// Skills of a world that nodes of others serve: actions and services of ROS 2, as the bridge sees skills. Each is sent
// once: what became of it and is not known is a failure, never a reason to ask again.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/node.hpp"
#include "pons/gate/ros/outside_call.hpp"
#include "pons/gate/ros/outside_form.hpp"
#include "pons/task/skill.hpp"
#include "pons/world/outside.hpp"

namespace pons::gate::ros {

class OutsideSkills {
 public:
  // After cancel(), so long a server may take to say that it has ended what it was at; after halt(), so long.
  static constexpr Duration kCancelledWithin = std::chrono::seconds(10), kHaltedWithin = std::chrono::seconds(2);
  static constexpr Duration kFeedbackPeriod = std::chrono::seconds(1);  // in the journal at most

  // `folders`: of interface files, where types are looked for that Pons does not know, in this order. Errors: those of
  // OutsideForm::compile().
  [[nodiscard]] static Expected<OutsideSkills> compile(std::span<const world::OutsideSkill> skills,
                                                       std::vector<std::filesystem::path> folders);
  // They wait for their servers in vain as long as there is no node. Error: there is a skill of that name already.
  [[nodiscard]] Expected<void> add_to(task::SkillRegistry& registry) const;
  // Before the node spins, on its thread; they may outlive it. Errors: those of Node::add_writer().
  [[nodiscard]] Expected<void> connect(Node& node) const;
  [[nodiscard]] bool has(std::string_view name) const;

 private:
  struct Skill {
    std::shared_ptr<const OutsideForm> form;
    std::shared_ptr<OutsideLine> line;
  };
  std::vector<Skill> skills_;
};

}  // namespace pons::gate::ros
