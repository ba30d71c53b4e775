#include "pons/record/ros_types.hpp"

#include <fmt/format.h>

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/wire/schema.hpp"

namespace pons::record {
namespace {

struct Field {
  std::string type;    // "uint8", "geometry_msgs/Point"
  std::string nested;  // that, if it is a message
  std::string array;   // "", "[3]", "[]"
  std::string name;
  bool operator==(const Field&) const = default;
};

using Definition = std::vector<Field>;

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(kBlank);
  return begin == text.npos ? std::string_view() : text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

// "std_msgs/msg/Header", "std_msgs/Header", in std_msgs "Header" -> "std_msgs/Header"
std::string short_name(std::string_view type, std::string_view package) {
  const auto first = type.find('/'), last = type.rfind('/');
  if (first == type.npos) return fmt::format("{}/{}", package, type);
  return fmt::format("{}/{}", type.substr(0, first), type.substr(last + 1));
}

bool is_primitive(std::string_view type) {
  static const std::set<std::string_view> kPrimitives{"bool",   "float32", "float64", "int8",   "uint8",
                                                      "int16",  "uint16",  "int32",   "uint32", "int64",
                                                      "uint64", "string",  "wstring"};
  return kPrimitives.contains(type);
}

std::optional<Field> field_of(std::string_view line, std::string_view package) {
  const auto space = line.find_first_of(kBlank);
  if (space == line.npos) return std::nullopt;
  std::string_view type = line.substr(0, space), rest = trimmed(line.substr(space));
  const auto end = std::min(rest.find_first_of(" \t\r=#"), rest.size());
  const std::string_view after = trimmed(rest.substr(end));
  if (after.starts_with('=')) return std::nullopt;  // a constant
  Field field{"", "", "", std::string(rest.substr(0, end))};
  if (const auto bracket = type.find('['); bracket != type.npos) {
    field.array = type.substr(bracket);
    if (field.array.starts_with("[<=")) field.array = "[]";
    type = type.substr(0, bracket);
  }
  type = type.substr(0, type.find("<="));
  field.type = type == "byte" || type == "char" ? "uint8" : type;
  if (!is_primitive(field.type)) field.type = field.nested = short_name(type, package);
  return field;
}

// By short name.
std::map<std::string, Definition, std::less<>> definitions_of(std::string_view root, std::string_view text) {
  std::map<std::string, Definition, std::less<>> all;
  std::string name = short_name(root, "");
  Definition* current = &all[name];
  bool heading = false;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.empty() || line.starts_with('#')) continue;
    if (line.starts_with("===")) {
      heading = true;
      continue;
    }
    if (heading && line.starts_with("MSG:")) {
      name = short_name(trimmed(line.substr(4)), "");
      current = &all[name];
      current->clear();
    } else if (const auto field = field_of(line, std::string_view(name).substr(0, name.find('/')))) {
      current->push_back(*field);
    }
    heading = false;
  }
  return all;
}

}  // namespace

bool same_layout(std::string_view type, std::string_view a, std::string_view b) {
  const auto of_a = definitions_of(type, a), of_b = definitions_of(type, b);
  std::set<std::string> seen{short_name(type, "")};
  std::vector<std::string> waiting{*seen.begin()};
  while (!waiting.empty()) {
    const std::string name = std::move(waiting.back());
    waiting.pop_back();
    const auto in_a = of_a.find(name), in_b = of_b.find(name);
    // Some writers leave these out: everybody knows them.
    const bool missing = in_a == of_a.end() || in_b == of_b.end();
    if (missing && name.starts_with("builtin_interfaces/")) continue;
    if (missing || in_a->second != in_b->second) return false;
    for (const Field& field : in_a->second) {
      if (!field.nested.empty() && seen.insert(field.nested).second) waiting.push_back(field.nested);
    }
  }
  return true;
}

Expected<const wire::KnownType*> known_type_of(const Contents& contents, const mcap::Channel& channel) {
  const std::string type(contents.type_of(channel));
  if (channel.message_encoding != "cdr")
    return fail(fmt::format("its messages are '{}', not CDR", channel.message_encoding), channel.topic);
  const auto candidates = wire::known_types(type);
  if (candidates.empty())
    return fail(type.empty() ? "it has no schema" : fmt::format("Pons does not know the type {}", type), channel.topic,
                "add its interface file to ros2/interfaces/, or leave the topic out");
  const auto hash = channel.metadata.find("topic_type_hash");
  const mcap::Schema& schema = contents.schemas.at(channel.schema);
  for (const wire::KnownType* each : candidates) {
    if (hash != channel.metadata.end() && hash->second == each->hash) return each;
    if (schema.encoding == "ros2msg" && same_layout(type, schema.data, wire::ros2msg_schema(each->name))) return each;
  }
  return fail(fmt::format("its {} is another version than the one that Pons knows", type), channel.topic,
              "leave the topic out, or read it with the program that it was recorded with");
}

}  // namespace pons::record
