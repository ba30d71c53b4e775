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

// Where `value` departs from `schema`, in the keywords that docs/schema/report.json uses.
inline void departures(const TestJson& value, const TestJson& schema, const std::string& at,
                       std::vector<std::string>& found) {
  if (!has_type(value, schema.at("type"))) found.push_back(at + ": is " + type_of(value));
  if (value.is_number() && schema.contains("minimum") && value < schema["minimum"]) found.push_back(at + ": too small");
  if (value.is_string() && schema.contains("pattern") &&
      !std::regex_match(value.get<std::string>(), std::regex(schema["pattern"].get<std::string>()))) {
    found.push_back(at + ": does not match");
  }
  if (!value.is_object()) return;
  for (const auto& key : schema.at("required")) {
    if (!value.contains(key.get<std::string>())) found.push_back(at + "/" + key.get<std::string>() + ": missing");
  }
  for (const auto& [key, part] : value.items()) {
    if (!schema.at("properties").contains(key)) {
      found.push_back(at + "/" + key + ": unknown");
    } else {
      departures(part, schema["properties"][key], at + "/" + key, found);
    }
  }
}

// Of a whole report. Reads the schema by its path from the root of the sources.
[[nodiscard]] inline std::vector<std::string> departures(const TestJson& report) {
  std::vector<std::string> found;
  departures(report, read_test_json("docs/schema/report.json"), "", found);
  return found;
}

}  // namespace pons::record
