#include "pons/world/yaml.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "pons/world/csv.hpp"

namespace pons::world {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxNameLength = 64;

[[noreturn]] void refuse_file(const std::filesystem::path& file, std::string what, std::string mend) {
  throw LoadError{{std::move(what), file.string(), std::move(mend)}};
}

// Runs over the file before any node is made.
class NoAliases final : public YAML::EventHandler {
 public:
  explicit NoAliases(const std::filesystem::path& file) : file_(file) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { refuse_anchor(mark, anchor); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override { refuse_anchor(mark, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string&) override {
    refuse_anchor(mark, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    refuse_anchor(mark, anchor);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    refuse_anchor(mark, anchor);
  }
  void OnMapEnd() override {}

 private:
  void refuse_anchor(const YAML::Mark& mark, YAML::anchor_t anchor) const {
    if (anchor == 0) return;
    throw LoadError{{"anchors (&) and aliases (*) are not read", fmt::format("{}:{}", file_.string(), mark.line + 1),
                     "write the value out"}};
  }

  const std::filesystem::path& file_;
};

std::string read_bounded(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(file, code)) refuse_file(file, "there is no such file", "create it");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse_file(file, "cannot be read", "check its permissions");
  std::string text(kMaxFileBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (text.size() > kMaxFileBytes) refuse_file(file, "is larger than 1 MiB", "some kilobytes of YAML are usual");
  if (!is_utf8(text)) refuse_file(file, "is not UTF-8 text", "save it as UTF-8");
  return text;
}

std::filesystem::path existing(const YamlValue& named, const std::filesystem::path& folder,
                               std::filesystem::file_type type) {
  std::filesystem::path path = (folder / named.text()).lexically_normal();
  std::error_code code;
  if (std::filesystem::status(path, code).type() != type) {
    named.refuse(fmt::format("there is no {} '{}'", type == std::filesystem::file_type::directory ? "folder" : "file",
                             printable(path.string())),
                 "name an existing one, relative to the world's folder");
  }
  return path;
}

}  // namespace

YamlValue::YamlValue(std::shared_ptr<const std::filesystem::path> file, const YAML::Node& node, std::string key)
    : file_(std::move(file)), node_(node), key_(std::move(key)) {}

std::string YamlValue::place() const {
  std::string where = fmt::format("{}:{}", file_->string(), std::max(node_.Mark().line, 0) + 1);
  if (!key_.empty()) where += ":" + key_;
  return where;
}

void YamlValue::refuse(std::string what, std::string mend) const {
  throw LoadError{{std::move(what), place(), std::move(mend)}};
}

std::string YamlValue::scalar(std::string_view expected) const {
  if (!node_.IsScalar()) {
    refuse(fmt::format("is {}, not {}",
                       node_.IsNull()  ? "empty"
                       : node_.IsMap() ? "a mapping"
                                       : "a list",
                       expected),
           fmt::format("write {}", expected));
  }
  return node_.Scalar();
}

double YamlValue::finite(std::string_view expected) const {
  const std::string word = scalar(expected);
  double value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) {
    refuse(fmt::format("'{}' is not a finite number", printable(word)), fmt::format("write {}", expected));
  }
  return value;
}

double YamlValue::number(double low, double high) const {
  const std::string expected = fmt::format("a number from {} to {}", low, high);
  const double value = finite(expected);
  if (value < low || value > high) refuse(fmt::format("{} is out of range", value), fmt::format("write {}", expected));
  return value;
}

double YamlValue::positive(double high) const {
  const std::string expected = fmt::format("a number above 0, up to {}", high);
  const double value = finite(expected);
  if (value <= 0 || value > high) refuse(fmt::format("{} is out of range", value), fmt::format("write {}", expected));
  return value;
}

int YamlValue::integer(int low, int high) const {
  const std::string expected = fmt::format("a whole number from {} to {}", low, high);
  const std::string word = scalar(expected);
  int value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc{} || end != word.data() + word.size() || value < low || value > high) {
    refuse(fmt::format("'{}' is not possible", printable(word)), fmt::format("write {}", expected));
  }
  return value;
}

bool YamlValue::boolean() const {
  const std::string word = scalar("yes or no");
  if (word == "yes" || word == "true") return true;
  if (word == "no" || word == "false") return false;
  refuse(fmt::format("'{}' is neither yes nor no", printable(word)), "write yes or no");
}

std::string YamlValue::text() const {
  std::string word = scalar("a text");
  if (word.empty()) refuse("is empty", "write a text");
  return word;
}

std::string YamlValue::name() const {
  std::string word = text();
  const bool fits = word.size() <= kMaxNameLength && std::ranges::all_of(word, [](char c) {
                      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
                    });
  if (!fits) refuse(fmt::format("'{}' is not a name", printable(word)), "use 1 to 64 of a-z, 0-9 and _");
  return word;
}

std::vector<YamlValue> YamlValue::list(std::size_t shortest, std::size_t longest) const {
  if (!node_.IsSequence()) refuse("is not a list", "write [a, b, …] or lines that begin with -");
  if (node_.size() < shortest || node_.size() > longest) {
    refuse(fmt::format("has {} entries", node_.size()),
           shortest == longest ? fmt::format("write {}", shortest) : fmt::format("write {} to {}", shortest, longest));
  }
  std::vector<YamlValue> values;
  for (std::size_t i = 0; i < node_.size(); ++i) values.emplace_back(file_, node_[i], fmt::format("{}[{}]", key_, i));
  return values;
}

std::vector<std::pair<std::string, YamlValue>> YamlValue::members(std::size_t most) const {
  if (!node_.IsMap()) refuse("is not a mapping", "write NAME: VALUE, a line each");
  if (node_.size() > most) refuse(fmt::format("has {} entries", node_.size()), fmt::format("write at most {}", most));
  std::vector<std::pair<std::string, YamlValue>> values;
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = YamlValue(file_, entry.first, key_).scalar("a key");
    YamlValue value(file_, entry.second, key_.empty() ? printable(key) : key_ + "." + printable(key));
    if (!seen.insert(key).second) value.refuse("the key is there twice", "keep one of them");
    values.emplace_back(key, std::move(value));
  }
  return values;
}

Vector3 YamlValue::vector(double reach) const {
  Vector3 vector = Vector3::Zero();
  const auto values = list(3, 3);
  for (std::size_t i = 0; i < 3; ++i) vector[static_cast<Eigen::Index>(i)] = values[i].number(-reach, reach);
  return vector;
}

AxisVector YamlValue::axes(std::size_t count, double low, double high) const {
  const auto values = count == 0 ? list(1, kMaxAxes) : list(count, count);
  AxisVector vector(static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) vector[static_cast<Eigen::Index>(i)] = values[i].number(low, high);
  return vector;
}

std::filesystem::path YamlValue::existing_file(const std::filesystem::path& folder) const {
  return existing(*this, folder, std::filesystem::file_type::regular);
}

std::filesystem::path YamlValue::existing_folder(const std::filesystem::path& folder) const {
  return existing(*this, folder, std::filesystem::file_type::directory);
}

YamlMap::YamlMap(const YamlValue& value, std::initializer_list<std::string_view> required,
                 std::initializer_list<std::string_view> optional)
    : value_(value) {
  std::vector<std::string_view> known(required);
  known.insert(known.end(), optional);
  const std::string keys = fmt::format("the keys here are {}", fmt::join(known, ", "));
  if (!value.node().IsMap()) value.refuse("is not a mapping", keys);

  std::set<std::string, std::less<>> seen;
  for (const auto& entry : value.node()) {
    const YamlValue name(value.file_, entry.first, value.key_);
    const std::string key = name.scalar("a key");
    const YamlValue at(value.file_, entry.first,
                       value.key_.empty() ? printable(key) : value.key_ + "." + printable(key));
    if (std::ranges::find(known, key) == known.end()) at.refuse("unknown key", keys);
    if (!seen.insert(key).second) at.refuse("the key is there twice", "keep one of them");
  }
  for (const std::string_view key : required) {
    if (!seen.contains(key)) value.refuse(fmt::format("key '{}' is missing", key), "add it; " + keys);
  }
}

YamlValue YamlMap::operator[](std::string_view key) const {
  return {value_.file_, value_.node()[std::string(key)],
          value_.key_.empty() ? std::string(key) : fmt::format("{}.{}", value_.key_, key)};
}

bool YamlMap::has(std::string_view key) const { return value_.node()[std::string(key)].IsDefined(); }

bool has_key(const YamlValue& value, std::string_view key) {
  return value.node().IsMap() && value.node()[std::string(key)].IsDefined();
}

YamlValue read_yaml(const std::filesystem::path& file) {
  const std::string text = read_bounded(file);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    NoAliases no_aliases(file);
    int documents = 0;
    while (parser.HandleNextDocument(no_aliases)) ++documents;
    if (documents != 1) {
      refuse_file(file, fmt::format("holds {} YAML documents", documents), "write one into it");
    }
    return {std::make_shared<const std::filesystem::path>(file), YAML::Load(text), ""};
  } catch (const YAML::Exception& broken) {
    throw LoadError{{fmt::format("broken YAML: {}", broken.msg),
                     fmt::format("{}:{}", file.string(), broken.mark.line + 1),
                     "mend the line, or one just before it"}};
  }
}

}  // namespace pons::world
