// A skill that others serve, as far as it is messages: what a task's arguments become, and what a reply means. Made of
// what a world's file says and of the types that Pons knows. No network; any thread.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/gate/ros/goal_client.hpp"
#include "pons/task/task.hpp"
#include "pons/wire/known_types.hpp"
#include "pons/world/outside.hpp"

namespace pons::gate::ros {

class OutsideForm {
 public:
  // Errors, each with its place in the file: a name that is none; a type that is not known, or no action or service; a
  // field that the type does not have, or that cannot hold what is written there, whatever the arguments.
  [[nodiscard]] static Expected<OutsideForm> compile(const world::OutsideSkill& skill);

  [[nodiscard]] const world::OutsideSkill& skill() const { return skill_; }
  [[nodiscard]] bool acts() const { return skill_.kind == world::OutsideSkill::Kind::kAction; }
  [[nodiscard]] ServiceTypes service_types() const;  // of a service
  [[nodiscard]] ActionTypes action_types() const;    // of an action

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
  [[nodiscard]] Expected<void> find_types();
  [[nodiscard]] Expected<void> check_fields() const;
  [[nodiscard]] wire::Json message(const task::Json& arguments, const GoalId& id) const;
  // What the fields of a result are read in.
  [[nodiscard]] wire::Json empty_result() const;

  world::OutsideSkill skill_;
  const wire::KnownType* request_ = nullptr;   // of a service's request, of send_goal's
  const wire::KnownType* decision_ = nullptr;  // of send_goal's response
  const wire::KnownType* ask_ = nullptr;       // of get_result's request
  const wire::KnownType* reply_ = nullptr;     // of a service's response, of get_result's
  const wire::KnownType* feedback_ = nullptr;
};

}  // namespace pons::gate::ros
