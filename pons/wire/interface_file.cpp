#include "pons/wire/interface_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <set>
#include <span>
#include <utility>

namespace pons::wire {
namespace {

constexpr std::string_view kBlank = " \t\r\v\f";
constexpr const char* kNoFields = "structure_needs_at_least_one_member";  // as rosidl fills what IDL does not know

constexpr std::array kPrimitives{std::pair{"bool", FieldBase::kBool},       std::pair{"byte", FieldBase::kByte},
                                 std::pair{"char", FieldBase::kUint8},      std::pair{"float32", FieldBase::kFloat32},
                                 std::pair{"float64", FieldBase::kFloat64}, std::pair{"int8", FieldBase::kInt8},
                                 std::pair{"uint8", FieldBase::kUint8},     std::pair{"int16", FieldBase::kInt16},
                                 std::pair{"uint16", FieldBase::kUint16},   std::pair{"int32", FieldBase::kInt32},
                                 std::pair{"uint32", FieldBase::kUint32},   std::pair{"int64", FieldBase::kInt64},
                                 std::pair{"uint64", FieldBase::kUint64},   std::pair{"string", FieldBase::kString}};

// Parts of a message's text, in the order of the file's, and those that every action has beside them.
struct Part {
  const char* name;
  const char* made;  // its text, with the interface's name in it; nullptr: the file has it
};
constexpr std::array kMessage{Part{"", nullptr}};
constexpr std::array kService{Part{"_Request", nullptr}, Part{"_Response", nullptr}};
constexpr std::array kAction{Part{"_Goal", nullptr},
                             Part{"_Result", nullptr},
                             Part{"_Feedback", nullptr},
                             Part{"_SendGoal_Request", "unique_identifier_msgs/UUID goal_id\n{0}_Goal goal"},
                             Part{"_SendGoal_Response", "bool accepted\nbuiltin_interfaces/Time stamp"},
                             Part{"_GetResult_Request", "unique_identifier_msgs/UUID goal_id"},
                             Part{"_GetResult_Response", "int8 status\n{0}_Result result"},
                             Part{"_FeedbackMessage", "unique_identifier_msgs/UUID goal_id\n{0}_Feedback feedback"}};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_of_a_word(char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '_'; }

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(kBlank);
  return begin == text.npos ? std::string_view() : text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

// What `text` begins with is taken off it.
std::string_view take_word(std::string_view& text) {
  const auto end = std::ranges::find_if_not(text, is_of_a_word);
  const std::string_view word = text.substr(0, static_cast<std::size_t>(end - text.begin()));
  if (word.empty() || !is_letter(word.front())) return {};
  text.remove_prefix(word.size());
  return word;
}
bool take(std::string_view& text, std::string_view token) {
  if (!text.starts_with(token)) return false;
  text.remove_prefix(token.size());
  return true;
}
std::optional<std::size_t> take_count(std::string_view& text) {
  std::uint32_t count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return count;
}

std::string_view without_comment(std::string_view line) {
  char quote = '\0';
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != '\0') {
      if (line[i] == quote) quote = '\0';
    } else if (line[i] == '"' || line[i] == '\'') {
      quote = line[i];
    } else if (line[i] == '#') {
      return trimmed(line.substr(0, i));
    }
  }
  return trimmed(line);
}

// ---- one line ----

struct Base {
  FieldBase base;
  std::string nested;
};

// "float64", "Point", "geometry_msgs/Point", "geometry_msgs/msg/Point"; nothing: none of these.
std::optional<Base> take_base(std::string_view& text, std::string_view package) {
  std::vector<std::string_view> words{take_word(text)};
  while (!words.back().empty() && words.size() < 3 && take(text, "/")) words.push_back(take_word(text));
  if (words.back().empty()) return std::nullopt;
  if (words.size() == 3) return Base{FieldBase::kNested, fmt::format("{}/{}/{}", words[0], words[1], words[2])};
  if (words.size() == 2) return Base{FieldBase::kNested, fmt::format("{}/msg/{}", words[0], words[1])};
  const auto found = std::ranges::find(kPrimitives, words[0], &decltype(kPrimitives)::value_type::first);
  if (found != kPrimitives.end()) return Base{found->second, {}};
  return Base{FieldBase::kNested, fmt::format("{}/msg/{}", package, words[0])};
}

Expected<FieldType> type_of(std::string_view text, std::string_view package, const std::string& where) {
  const auto refuse = [&](std::string_view why, std::string_view mend) {
    return fail(fmt::format("'{}' {}", text, why), where, std::string(mend));
  };
  std::string_view rest = text;
  const auto base = take_base(rest, package);
  const auto most_chars = take(rest, "<=") ? take_count(rest) : std::optional<std::size_t>(0);
  const bool several = take(rest, "["), bounded = several && take(rest, "<=");
  const auto elements = several ? take_count(rest) : std::nullopt;
  if (!base || !most_chars || (bounded && !elements) || (several && !take(rest, "]")) || !rest.empty())
    return refuse("is no type", "write a primitive type or PACKAGE/NAME, and [], [3] or [<=3] where there are several");
  if (std::string_view word = text; take_word(word) == "wstring")
    return refuse("is not supported", "what its bytes are, the vendors do not agree about: make it a string");
  if (*most_chars != 0 && base->base != FieldBase::kString) return refuse("has a bound", "only a string has one");
  if (*most_chars != 0 && several)
    return refuse("has a bound for each of its texts, which is not supported", "leave out the inner bound");
  if (elements == std::size_t{0}) return refuse("has no elements", "an array has at least one");
  return FieldType{.base = base->base,
                   .nested = base->nested,
                   .most_chars = *most_chars,
                   .count = !several   ? FieldCount::kOne
                            : bounded  ? FieldCount::kBoundedSequence
                            : elements ? FieldCount::kArray
                                       : FieldCount::kSequence,
                   .elements = elements.value_or(0)};
}

std::optional<Json> whole_number(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative || text.starts_with('+')) text.remove_prefix(1);
  const int base = take(text, "0x") || take(text, "0X") ? 16 : take(text, "0b") ? 2 : take(text, "0o") ? 8 : 10;
  std::uint64_t magnitude = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), magnitude, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!negative) return magnitude;
  if (magnitude > std::uint64_t{1} << 63U) return std::nullopt;
  return static_cast<std::int64_t>(0 - magnitude);
}

std::optional<Json> real_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<Json> truth(std::string_view text) {
  std::string word(text);
  std::ranges::transform(word, word.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  if (word == "true" || word == "1") return true;
  if (word == "false" || word == "0") return false;
  return std::nullopt;
}

Expected<Json> value_of(std::string_view text, FieldBase base, const std::string& where) {
  std::optional<Json> value;
  if (base == FieldBase::kString) {
    const bool quoted = text.size() > 1 && text.front() == text.back() && (text.front() == '"' || text.front() == '\'');
    value = std::string(quoted ? text.substr(1, text.size() - 2) : text);
  } else if (base == FieldBase::kBool) {
    value = truth(text);
  } else {
    value = base == FieldBase::kFloat32 || base == FieldBase::kFloat64 ? real_number(text) : whole_number(text);
  }
  if (value) return *std::move(value);
  return fail(fmt::format("'{}' is no value for it", text), where,
              "write a number, or true or false, as its type says");
}

Expected<Json> preset_of(std::string_view text, const FieldType& type, const std::string& where) {
  if (type.base == FieldBase::kNested)
    return fail("a message has no default", where, "only numbers, truth values and strings have one");
  if (type.count == FieldCount::kOne) return value_of(text, type.base, where);
  if (!take(text, "[") || !text.ends_with(']')) return fail("the default of several is a list", where, "write [1, 2]");
  text.remove_suffix(1);
  Json list = Json::array();
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(','), text.size());
    if (const std::string_view one = trimmed(text.substr(0, end)); !one.empty()) {
      auto value = value_of(one, type.base, where);
      if (!value) return value;
      list.push_back(*std::move(value));
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return list;
}

// ---- a file ----

class File {
 public:
  File(std::string_view interface, const InterfaceText& file)
      : package_(interface.substr(0, interface.find('/'))), file_(file) {}

  // All that stands between two lines of dashes.
  Expected<std::vector<MessageLines>> parts() {
    std::vector<MessageLines> parts(1);
    std::set<std::string, std::less<>> names;
    std::string_view text = file_.text;
    for (int number = 1; !text.empty(); ++number) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      const std::string_view line = without_comment(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (line == "---") {
        parts.emplace_back();
        names.clear();
      } else if (!line.empty()) {
        auto added = add(line, fmt::format("{}:{}", file_.where, number), parts.back().fields, names);
        if (!added) return std::unexpected(added.error());
      }
    }
    for (MessageLines& part : parts) {
      if (part.fields.empty()) part.fields.push_back({.name = kNoFields, .type = {FieldBase::kUint8}, .where = {}});
    }
    return parts;
  }

 private:
  Expected<void> add(std::string_view line, const std::string& where, std::vector<FieldLine>& fields,
                     std::set<std::string, std::less<>>& names) const {
    const std::size_t blank = std::min(line.find_first_of(kBlank), line.size());
    std::string_view rest = trimmed(line.substr(blank));
    const std::string_view name = take_word(rest);
    const auto type = type_of(line.substr(0, blank), package_, where);
    if (!type) return std::unexpected(type.error());
    if (name.empty())
      return fail(fmt::format("'{}' is neither a field nor a constant", line), where,
                  "write TYPE NAME or TYPE NAME=VALUE");
    if (!names.emplace(name).second)
      return fail(fmt::format("there are two '{}'", name), where, "give one of them another name");
    rest = trimmed(rest);
    if (rest.starts_with('=')) return {};  // a constant is no part of what is sent
    FieldLine field{.name = std::string(name), .type = *type, .where = where};
    if (!rest.empty()) {
      auto preset = preset_of(rest, *type, where);
      if (!preset) return std::unexpected(preset.error());
      field.preset = *std::move(preset);
    }
    fields.push_back(std::move(field));
    return {};
  }

  std::string_view package_;
  const InterfaceText& file_;
};

std::span<const Part> parts_of(std::string_view interface) {
  if (interface.find("/action/") != interface.npos) return kAction;
  if (interface.find("/srv/") != interface.npos) return kService;
  return kMessage;
}

}  // namespace

Expected<std::vector<MessageLines>> read_interface(std::string_view interface, const InterfaceText& file) {
  const auto parts = parts_of(interface);
  auto messages = File(interface, file).parts();
  if (!messages) return messages;
  const auto wanted = static_cast<std::size_t>(std::ranges::count(parts, nullptr, &Part::made));
  if (messages->size() != wanted)
    return fail(fmt::format("it has {} parts", messages->size()), file.where,
                fmt::format("divide it by --- into {}", wanted));
  for (const Part& part : parts.subspan(wanted)) {
    const InterfaceText text{fmt::format(fmt::runtime(part.made), interface), file.where};
    messages->push_back(File(interface, text).parts()->front());
  }
  for (std::size_t i = 0; i < parts.size(); ++i) (*messages)[i].name = fmt::format("{}{}", interface, parts[i].name);
  return messages;
}

}  // namespace pons::wire
