// What a world's file says about skills that nodes of others serve (`skills:`). Names of types and fields are texts
// here: what they mean, only who knows the types can say (pons/gate/ros/outside_form.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "pons/core/time.hpp"

namespace pons::world {

// A text of the file, and where it stands: file, line and key.
struct Placed {
  std::string text, where;
};

// What a task gives with a use of such a skill.
struct OutsideArgument {
  enum class Kind : std::uint8_t { kNumber, kInteger, kText, kBoolean };
  std::string name;
  Kind kind = Kind::kNumber;
  double minimum = -1e9, maximum = 1e9;                                // of numbers
  std::vector<std::string> choices = {};                               // of a text; none: any
  std::optional<std::variant<bool, double, std::string>> preset = {};  // where a task leaves it out
};

// Text and arguments in turn.
struct Piece {
  enum class Kind : std::uint8_t {
    kText,
    kArgument,
    kQuaternion,  // the turn by that argument, rad, about z; as a geometry_msgs/Quaternion
  };
  Kind kind = Kind::kText;
  std::string text;  // or the argument's name
};

// A value of a message, into which arguments are filled.
struct Filling {
  enum class Kind : std::uint8_t {
    kWord,      // without quotes: a number, yes, no, or a text
    kText,      // its pieces; one argument alone keeps its type
    kMembers,   // of a message
    kElements,  // of a list
  };
  Kind kind = Kind::kMembers;
  std::string where;
  std::string name;  // of a member
  std::string word;
  std::vector<Piece> pieces;
  std::vector<Filling> parts;  // members, or elements
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
