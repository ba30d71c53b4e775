// Holds a report against docs/schema/report.json, for tests of this folder and of the whole program.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

namespace pons::record {

using TestJson = nlohmann::ordered_json;

[[nodiscard]] inline TestJson read_test_json(const std::filesystem::path& path) {
  std::ifstream file(path);
  return TestJson::parse(file);
}

// The schema with each {"$ref": "#/$defs/…"} replaced by what it names.
[[nodiscard]] inline TestJson resolved(const TestJson& part, const TestJson& root) {
  if (part.is_object() && part.contains("$ref"))
    return resolved(root.at(TestJson::json_pointer(part["$ref"].get<std::string>().substr(1))), root);
  TestJson whole = part;
  if (part.is_structured()) {
    for (auto& [key, inner] : whole.items()) inner = resolved(inner, root);
  }
  return whole;
}
[[nodiscard]] inline TestJson resolved(const TestJson& root) { return resolved(root, root); }

[[nodiscard]] inline std::string type_of(const TestJson& value) {
  if (value.is_number_integer()) return "integer";
  return value.type_name();
}

[[nodiscard]] inline bool has_type(const TestJson& value, const TestJson& types) {
  const auto fits = [&](const TestJson& type) {
    return type == type_of(value) || (type == "number" && value.is_number());
  };
  return types.is_array() ? std::any_of(types.begin(), types.end(), fits) : fits(types);
}

inline void departures(const TestJson& value, const TestJson& schema, const std::string& at,
                       std::vector<std::string>& found);

inline void departures_of_members(const TestJson& value, const TestJson& schema, const std::string& at,
                                  std::vector<std::string>& found) {
  for (const auto& key : schema.value("required", TestJson::array())) {
    if (!value.contains(key.get<std::string>())) found.push_back(at + "/" + key.get<std::string>() + ": missing");
  }
  const TestJson others = schema.value("additionalProperties", TestJson(true));
  for (const auto& [key, part] : value.items()) {
    const std::string place = at + "/" + key;
    if (schema.contains("properties") && schema["properties"].contains(key)) {
      departures(part, schema["properties"][key], place, found);
    } else if (others.is_object()) {
      departures(part, others, place, found);
    } else if (others == false) {
      found.push_back(place + ": unknown");
    }
  }
}

// Where `value` departs from `schema`, in the keywords that the schemas of docs/schema use for reports.
inline void departures(const TestJson& value, const TestJson& schema, const std::string& at,
                       std::vector<std::string>& found) {
  if (!has_type(value, schema.at("type"))) found.push_back(at + ": is " + type_of(value));
  if (value.is_number() && schema.contains("minimum") && value < schema["minimum"]) found.push_back(at + ": too small");
  if (value.is_number() && schema.contains("maximum") && value > schema["maximum"]) found.push_back(at + ": too large");
  if (value.is_string() && schema.contains("pattern") &&
      !std::regex_match(value.get<std::string>(), std::regex(schema["pattern"].get<std::string>()))) {
    found.push_back(at + ": does not match");
  }
  if (value.is_string() && schema.contains("enum") &&
      std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end()) {
    found.push_back(at + ": is none of those");
  }
  if (value.is_object()) departures_of_members(value, schema, at, found);
  if (!value.is_array()) return;
  if (schema.contains("maxItems") && value.size() > schema["maxItems"]) found.push_back(at + ": too many");
  for (std::size_t i = 0; i < value.size(); ++i)
    departures(value[i], schema.at("items"), at + "/" + std::to_string(i), found);
}

// Of a whole report. Reads the schema by its path from the root of the sources.
[[nodiscard]] inline std::vector<std::string> departures(
    const TestJson& report, const std::filesystem::path& schema = "docs/schema/report.json") {
  std::vector<std::string> found;
  departures(report, resolved(read_test_json(schema)), "", found);
  return found;
}

}  // namespace pons::record
