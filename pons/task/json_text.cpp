#include "pons/task/json_text.hpp"

#include <fmt/format.h>

#include <set>
#include <string>
#include <vector>

namespace pons::task {
namespace {

// Reads the text once without building anything, so that the builder only ever sees text within the bounds.
class Bounds final : public nlohmann::json_sax<Json> {
 public:
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
    problem = error.id == 406 ? fmt::format("number out of range at byte {}", position)
                              : fmt::format("not JSON in UTF-8 at byte {}", position);
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

  std::vector<std::set<std::string>> names_;  // of the objects now open; arrays have an empty set
};

}  // namespace

Expected<Json> parse_json(std::string_view text) {
  if (text.size() > kMaxJsonBytes) {
    return fail(fmt::format("{} bytes of JSON", text.size()), {}, fmt::format("send at most {} bytes", kMaxJsonBytes));
  }
  // The parser takes a zero byte for the end of the text.
  if (const auto zero = text.find('\0'); zero != text.npos) {
    return fail(fmt::format("not JSON in UTF-8 at byte {}", zero + 1), {}, "send one JSON value (RFC 8259)");
  }
  Bounds bounds;
  if (!Json::sax_parse(text, &bounds)) return fail(bounds.problem, {}, "send one JSON value (RFC 8259)");
  return Json::parse(text);
}

std::string excerpt(std::string_view text, std::size_t bytes) {
  const bool cut = text.size() > bytes;
  if (cut) {
    std::size_t end = bytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text = text.substr(0, end);
  }
  std::string shown;
  for (const char byte : text) {
    const auto code = static_cast<unsigned char>(byte);
    if (code < 0x20 || code == 0x7F) {
      shown += fmt::format("\\x{:02x}", code);
    } else {
      shown += byte;
    }
  }
  return cut ? shown + "…" : shown;
}

}  // namespace pons::task
