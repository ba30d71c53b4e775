// What a world's file says about skills that nodes of others serve (`skills:`). Names of types and fields are texts
// here: what they mean, only who knows the types can say (pons/gate/ros/outside_form.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pons/core/time.hpp"
#include "pons/world/filling.hpp"

namespace pons::world {

// What a task gives with a use of such a skill.
struct OutsideArgument {
  enum class Kind : std::uint8_t { kNumber, kInteger, kText, kBoolean };
  std::string name;
  Kind kind = Kind::kNumber;
  double minimum = -1e9, maximum = 1e9;                                // of numbers
  std::vector<std::string> choices = {};                               // of a text; none: any
  std::optional<std::variant<bool, double, std::string>> preset = {};  // where a task leaves it out
};

struct OutsideSkill {
  enum class Kind : std::uint8_t { kAction, kService };
  std::string name, summary;
  Kind kind = Kind::kAction;
  Placed server;  // "/navigate_to_pose"
  Placed type;    // "nav2_msgs/action/NavigateToPose"
  std::vector<OutsideArgument> arguments;
  Filling message;  // the goal, or the request
  std::vector<std::string> resources;
  Duration timeout{0}, server_wait{0};
  std::optional<Placed> success;            // a field of the result that must be true
  std::optional<Placed> reason;             // one that says why not
  std::optional<std::vector<Placed>> told;  // of the feedback, what the journal keeps; without: all of it
  std::string where;
};

}  // namespace pons::world
