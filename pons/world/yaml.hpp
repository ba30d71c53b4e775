// Reading a YAML file strictly: what is read is declared, everything else is an error that names file, line and key.
// Part of loading, so it throws LoadError; nothing outside pons/world sees it.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/pose.hpp"

namespace pons::world {

struct LoadError {
  Error error;
};

// A node of the file and how one gets there ("robot.limits.torque_nm[2]"). Every reader below throws LoadError when the
// node is of another shape or out of range.
class YamlValue {
 public:
  YamlValue(std::shared_ptr<const std::filesystem::path> file, const YAML::Node& node, std::string key);

  // In [low, high], finite.
  [[nodiscard]] double number(double low, double high) const;
  // In (0, high].
  [[nodiscard]] double positive(double high) const;
  [[nodiscard]] int integer(int low, int high) const;
  [[nodiscard]] bool boolean() const;  // yes, no, true, false
  [[nodiscard]] std::string text() const;
  // 1 to 64 of a–z, 0–9 and _.
  [[nodiscard]] std::string name() const;
  [[nodiscard]] std::vector<YamlValue> list(std::size_t shortest, std::size_t longest) const;
  // Of a mapping with any keys, each there once.
  [[nodiscard]] std::vector<std::pair<std::string, YamlValue>> members(std::size_t most) const;
  // Each component in [-reach, reach].
  [[nodiscard]] Vector3 vector(double reach) const;
  // `count` numbers, each in [low, high]; count 0 takes any length up to kMaxAxes.
  [[nodiscard]] AxisVector axes(std::size_t count, double low, double high) const;
  // An existing file, named relative to `folder`.
  [[nodiscard]] std::filesystem::path existing_file(const std::filesystem::path& folder) const;

  // Likewise, of a folder.
  [[nodiscard]] std::filesystem::path existing_folder(const std::filesystem::path& folder) const;
  // For a message: file, line and key.
  [[nodiscard]] std::string place() const;
  [[noreturn]] void refuse(std::string what, std::string mend) const;
  [[nodiscard]] const YAML::Node& node() const { return node_; }

 private:
  friend class YamlMap;
  [[nodiscard]] std::string scalar(std::string_view expected) const;
  [[nodiscard]] double finite(std::string_view expected) const;

  std::shared_ptr<const std::filesystem::path> file_;
  YAML::Node node_;
  std::string key_;
};

// A mapping with exactly the declared keys; refuses missing, unknown and repeated ones when it is made.
class YamlMap {
 public:
  YamlMap(const YamlValue& value, std::initializer_list<std::string_view> required,
          std::initializer_list<std::string_view> optional = {});

  // A declared key.
  [[nodiscard]] YamlValue operator[](std::string_view key) const;
  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] const YamlValue& value() const { return value_; }

 private:
  YamlValue value_;
};

// Whether the mapping has that key, whatever else it has; false for what is no mapping.
[[nodiscard]] bool has_key(const YamlValue& value, std::string_view key);

// The file's one document. Refuses more than 1 MiB, anything but UTF-8, broken YAML, and anchors and aliases (a few
// lines of them can stand for gigabytes).
[[nodiscard]] YamlValue read_yaml(const std::filesystem::path& file);

}  // namespace pons::world
