#include "pons/task/json_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace pons::task {
namespace {

// The first byte is 1, and so is the first line; one that stands for itself is not told.
std::string place_of(std::size_t byte, std::string_view text) {
  const auto lines = std::ranges::count(text.substr(0, byte), '\n');
  return fmt::format("byte {}{}", byte, lines == 0 ? "" : fmt::format(", in line {}", lines + 1));
}

// Reads the text once without building anything, so that the builder only ever sees text within the bounds.
class Bounds final : public nlohmann::json_sax<Json> {
 public:
  explicit Bounds(std::string_view text) : text_(text) {}
  std::string problem;

  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool start_object(std::size_t) override { return enter(); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(); }
  bool end_array() override { return leave(); }

  bool key(string_t& name) override {
    if (names_.back().insert(name).second) return true;
    problem = fmt::format("the name '{}' comes twice in one object", excerpt(name));
    return false;
  }

  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& error) override {
    // 406: a number beyond a double. Everything else is bad syntax or bad UTF-8, which what() may quote byte for byte.
    problem = fmt::format("{} at {}", error.id == 406 ? "number out of range" : "not JSON in UTF-8",
                          place_of(position, text_));
    return false;
  }

 private:
  bool enter() {
    names_.emplace_back();
    if (names_.size() <= static_cast<std::size_t>(kMaxJsonDepth)) return true;
    problem = fmt::format("nested deeper than {} levels", kMaxJsonDepth);
    return false;
  }
  bool leave() {
    names_.pop_back();
    return true;
  }

  std::string_view text_;
  std::vector<std::set<std::string>> names_;  // of the objects now open; arrays have an empty set
};

// Knows where it is, as deep as anybody asks.
class Glimpser final : public nlohmann::json_sax<Json> {
 public:
  explicit Glimpser(std::span<const std::string_view> places) : places_(places) {}

  std::map<std::string, std::string, std::less<>> seen;

  bool null() override { return scalar({}); }
  bool boolean(bool) override { return scalar({}); }
  bool number_integer(number_integer_t) override { return scalar({}); }
  bool number_unsigned(number_unsigned_t) override { return scalar({}); }
  bool number_float(number_float_t, const string_t&) override { return scalar({}); }
  bool string(string_t& value) override { return scalar(value); }
  bool binary(binary_t&) override { return scalar({}); }
  bool start_object(std::size_t) override { return enter(Level::kObject); }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t) override { return enter(Level::kArray); }
  bool end_array() override { return leave(); }
  bool key(string_t& name) override {
    // No place has "~": a name with a '/' is none of those that are looked for.
    if (deeper_ == 0) levels_.back().name = name.find_first_of("/~") == name.npos ? name : "~";
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override { return false; }

 private:
  static constexpr std::size_t kDeepest = 3;
  struct Level {
    enum Of : std::uint8_t { kObject, kArray } of = kObject;
    std::size_t index = 0;
    std::string name;
  };

  void look(std::string_view value) {
    std::string here;
    for (const Level& level : levels_)
      here += '/' + (level.of == Level::kArray ? std::to_string(level.index) : level.name);
    if (std::ranges::find(places_, here) != places_.end()) seen.emplace(here, value);
  }
  bool scalar(std::string_view value) {
    if (deeper_ == 0) look(value);
    return next();
  }
  bool next() {
    if (deeper_ == 0 && !levels_.empty()) ++levels_.back().index;
    return true;
  }
  bool enter(Level::Of of) {
    if (deeper_ == 0) look({});
    if (deeper_ > 0 || levels_.size() == kDeepest) {
      ++deeper_;
    } else {
      levels_.push_back({of, 0, {}});
    }
    return true;
  }
  bool leave() {
    if (deeper_ > 0) {
      --deeper_;
    } else {
      levels_.pop_back();
    }
    return next();
  }

  std::span<const std::string_view> places_;
  std::vector<Level> levels_;
  std::size_t deeper_ = 0;  // so many are open below the last of these
};

}  // namespace

Expected<Json> parse_json(std::string_view text) {
  if (text.size() > kMaxJsonBytes) {
    return fail(fmt::format("{} bytes of JSON", text.size()), {}, fmt::format("send at most {} bytes", kMaxJsonBytes));
  }
  // The parser takes a zero byte for the end of the text.
  if (const auto zero = text.find('\0'); zero != text.npos) {
    return fail(fmt::format("not JSON in UTF-8 at {}", place_of(zero + 1, text)), {}, "send one JSON value (RFC 8259)");
  }
  Bounds bounds(text);
  if (!Json::sax_parse(text, &bounds)) return fail(bounds.problem, {}, "send one JSON value (RFC 8259)");
  return Json::parse(text);
}

std::map<std::string, std::string, std::less<>> glimpse(std::string_view text,
                                                        std::span<const std::string_view> places) {
  text = text.substr(0, kMaxJsonBytes);
  Glimpser glimpser(places);
  (void)Json::sax_parse(text.substr(0, text.find('\0')), &glimpser);
  return std::move(glimpser.seen);
}

bool nests_deeper(std::string_view text, std::size_t levels) {
  std::size_t open = 0;
  bool quoted = false;
  // As long as it is JSON, a parser sees the same brackets; where it is none any more, a parser has stopped.
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char each = text[i];
    if (quoted) {
      if (each == '\\') ++i;
      quoted = each != '"';
    } else if (each == '"') {
      quoted = true;
    } else if (each == '[' || each == '{') {
      if (++open > levels) return true;
    } else if ((each == ']' || each == '}') && open > 0) {
      --open;
    }
  }
  return false;
}

std::string excerpt(std::string_view text, std::size_t bytes) {
  const bool cut = text.size() > bytes;
  if (cut) {
    std::size_t end = bytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text = text.substr(0, end);
  }
  std::string shown;
  const auto code_at = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  for (std::size_t i = 0; i < text.size(); ++i) {
    const unsigned code = code_at(i), next = code_at(i + 1);
    if (code < 0x20 || code == 0x7F) {
      shown += fmt::format("\\x{:02x}", code);
    } else if (code == 0xC2 && next >= 0x80 && next < 0xA0) {
      shown += fmt::format("\\x{:02x}", next);
      ++i;
    } else {
      shown += text[i];
    }
  }
  return cut ? shown + "…" : shown;
}

}  // namespace pons::task
