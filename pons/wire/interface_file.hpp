// ROS 2 interface files (.msg, .srv, .action), as far as tools/ros_interfaces.py reads them, too: what the messages
// consist of that rosidl makes of them. Text in, lines out; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/wire/json.hpp"

namespace pons::wire {

struct InterfaceText {
  std::string text;
  std::string where;  // the file, for messages
};

// The numbers are REP-2011's, of one value.
enum class FieldBase : std::uint8_t {
  kNested = 1,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kBool = 15,
  kByte,
  kString,
};
// What REP-2011 adds where there are several.
enum class FieldCount : std::uint8_t { kOne = 0, kArray = 48, kBoundedSequence = 96, kSequence = 144 };

struct FieldType {
  FieldBase base = FieldBase::kNested;
  std::string nested = {};     // "geometry_msgs/msg/Point"
  std::size_t most_chars = 0;  // of a text; 0: any
  FieldCount count = FieldCount::kOne;
  std::size_t elements = 0;  // of an array; of a bounded sequence, at most
};

struct FieldLine {
  std::string name;
  FieldType type;
  Json preset = nullptr;  // null: there is none
  std::string where;      // file and line
};

struct MessageLines {
  std::string name;  // "std_srvs/srv/SetBool_Request"
  std::vector<FieldLine> fields;
};

// Of "std_srvs/srv/SetBool": the messages that a client sends and gets, without a service's event. Errors name file and
// line: what is no line of an interface file, and what the tool refuses, too: wstring, and texts of bounded length in
// arrays and sequences.
[[nodiscard]] Expected<std::vector<MessageLines>> read_interface(std::string_view interface, const InterfaceText& file);

}  // namespace pons::wire
