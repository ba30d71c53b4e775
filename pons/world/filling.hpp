// A value in a world's file that has places for what comes later: a message for other nodes, the arguments of a step.
// In its texts "{name}" is such a place, and {{ and }} are braces.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace pons::world {

// A text of the file, and where it stands: file, line and key.
struct Placed {
  std::string text, where;
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

}  // namespace pons::world
