// A skill that others serve, as far as it is messages: what a task's arguments become, and what a reply means. Made of
// what a world's file says and of types that Pons knows or interface files define. No network; any thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/goal_client.hpp"
#include "pons/task/task.hpp"
#include "pons/wire/interface_types.hpp"
#include "pons/wire/known_types.hpp"
#include "pons/world/outside.hpp"

namespace pons::gate::ros {

class OutsideForm {
 public:
  // `types`: where those are looked for that Pons does not know. Errors, each with its place in the file: a name that
  // is none; a type that is found nowhere, or no action or service; an interface file that cannot be read; a field that
  // the type does not have, or that cannot hold what is written there, whatever the arguments.
  [[nodiscard]] static Expected<OutsideForm> compile(const world::OutsideSkill& skill, wire::InterfaceTypes& types);

  [[nodiscard]] const world::OutsideSkill& skill() const { return skill_; }
  [[nodiscard]] bool acts() const { return skill_.kind == world::OutsideSkill::Kind::kAction; }
  // Of a service, of an action; valid as long as this lives.
  [[nodiscard]] ServiceTypes service_types() const;
  [[nodiscard]] ActionTypes action_types() const;

  // JSON schema of the arguments, as task::SkillType has it.
  [[nodiscard]] task::Json schema() const;
  // The fields of what it succeeds with.
  [[nodiscard]] std::vector<std::string> outputs() const;

  // The request, of an action that of send_goal with this id, with room for a header before it; `arguments` keep to the
  // schema. Error: a number is beyond what its field holds, a text longer.
  [[nodiscard]] Expected<std::vector<std::byte>> request(const task::Json& arguments, const GoalId& id) const;

  struct Reply {
    task::Json result;    // a service's response, an action's result
    bool success = true;  // as the field says that is to be true
    std::string reason;   // as the field says that tells why not
  };
  // Of a service's response; of get_result's. Errors: those of decode().
  [[nodiscard]] Expected<Reply> reply(std::span<const std::byte> cdr) const;
  // What is to be kept of a feedback message. Errors: likewise.
  [[nodiscard]] Expected<task::Json> feedback(std::span<const std::byte> cdr) const;

 private:
  explicit OutsideForm(world::OutsideSkill skill) : skill_(std::move(skill)) {}
  [[nodiscard]] Expected<void> find_types(wire::InterfaceTypes& types);
  [[nodiscard]] Expected<void> check_fields() const;
  [[nodiscard]] wire::Json message(const task::Json& arguments, const GoalId& id) const;
  // What the fields of a result are read in.
  [[nodiscard]] wire::Json empty_result() const;

  world::OutsideSkill skill_;
  wire::KnownType request_;   // of a service's request, of send_goal's
  wire::KnownType decision_;  // of send_goal's response
  wire::KnownType ask_;       // of get_result's request
  wire::KnownType reply_;     // of a service's response, of get_result's
  wire::KnownType feedback_;
};

}  // namespace pons::gate::ros
