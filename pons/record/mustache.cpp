#include "pons/record/mustache.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace pons::record {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kOpen = "{{", kClose = "}}";

struct BadTemplate {
  std::size_t at;
  std::string what;
};

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string_view trimmed(std::string_view text) {
  const std::size_t from = text.find_first_not_of(" \t\n");
  return from == std::string_view::npos ? std::string_view{}
                                        : text.substr(from, text.find_last_not_of(" \t\n") - from + 1);
}

bool is_something(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number()) return value != 0;
  if (value.is_string()) return !value.get_ref<const std::string&>().empty();
  return !value.is_null() && !value.empty();
}

struct Tag {
  char kind = ' ';  // # ^ / ! or a value
  std::string_view name;
  std::size_t begin = 0, end = 0;  // of what it replaces, the rest of its own line included where it stands alone
};

class Template {
 public:
  Template(std::string_view text, const Json& view) : text_(text), scopes_{&view} {}

  std::string whole() {
    section({}, true);
    return std::move(out_);
  }

 private:
  // To the end of the section that is called `name`, or of the text; what is not `shown` is only read over.
  void section(std::string_view name, bool shown) {
    const std::size_t begun = at_;
    while (const auto tag = next()) {
      if (shown) out_ += text_.substr(at_, tag->begin - at_);
      at_ = tag->end;
      if (tag->kind == '/') {
        if (tag->name != name || name.empty())
          throw BadTemplate{tag->begin, fmt::format("'{}' is not open", tag->name)};
        return;
      }
      if (tag->kind == '#' || tag->kind == '^') {
        inner(*tag, shown);
      } else if (tag->kind == ' ' && shown) {
        out_ += escaped(text_of(*tag));
      }
    }
    if (!name.empty()) throw BadTemplate{begun, fmt::format("'{}' is not closed", name)};
    if (shown) out_ += text_.substr(at_);
  }

  void inner(const Tag& tag, bool shown) {
    if (!shown) return section(tag.name, false);
    const Json& value = find(tag);
    if (tag.kind == '^' || !is_something(value)) return section(tag.name, (tag.kind == '^') != is_something(value));
    const std::size_t from = at_;
    const std::size_t times = value.is_array() ? value.size() : 1;
    for (std::size_t i = 0; i < times; ++i) {
      at_ = from;
      scopes_.push_back(value.is_array() ? &value[i] : &value);
      section(tag.name, true);
      scopes_.pop_back();
    }
  }

  std::optional<Tag> next() const {
    const std::size_t begin = text_.find(kOpen, at_);
    if (begin == std::string_view::npos) return std::nullopt;
    const std::size_t close = text_.find(kClose, begin);
    if (close == std::string_view::npos) throw BadTemplate{begin, "a tag has no end"};
    std::string_view inside = trimmed(text_.substr(begin + kOpen.size(), close - begin - kOpen.size()));
    Tag tag{.begin = begin, .end = close + kClose.size()};
    if (!inside.empty() && std::string_view("#^/!").contains(inside.front())) {
      tag.kind = inside.front();
      inside = trimmed(inside.substr(1));
      take_line(tag);
    }
    tag.name = inside;
    return tag;
  }

  void take_line(Tag& tag) const {
    const auto blank = [this](std::size_t i) { return text_[i] == ' ' || text_[i] == '\t'; };
    std::size_t begin = tag.begin, end = tag.end;
    while (begin > at_ && blank(begin - 1)) --begin;
    while (end < text_.size() && blank(end)) ++end;
    if ((begin != 0 && text_[begin - 1] != '\n') || end == text_.size() || text_[end] != '\n') return;
    tag.begin = begin;
    tag.end = end + 1;
  }

  std::string text_of(const Tag& tag) const {
    const Json& value = find(tag);
    if (value.is_structured()) throw BadTemplate{tag.begin, fmt::format("'{}' is no single value", tag.name)};
    if (value.is_string()) return value.get<std::string>();
    return value.is_null() ? std::string() : value.dump();
  }

  const Json& find(const Tag& tag) const {
    if (tag.name == ".") return *scopes_.back();
    const std::string_view first = tag.name.substr(0, tag.name.find('.'));
    for (auto scope = scopes_.rbegin(); scope != scopes_.rend(); ++scope) {
      if (!(*scope)->is_object() || !(*scope)->contains(first)) continue;
      const Json* value = *scope;
      for (std::string_view rest = tag.name; !rest.empty();) {
        const std::string_view key = rest.substr(0, rest.find('.'));
        if (!value->is_object() || !value->contains(key)) throw BadTemplate{tag.begin, unknown(tag)};
        value = &value->at(std::string(key));
        rest.remove_prefix(std::min(rest.size(), key.size() + 1));
      }
      return *value;
    }
    throw BadTemplate{tag.begin, unknown(tag)};
  }

  static std::string unknown(const Tag& tag) { return fmt::format("there is no '{}'", tag.name); }

  std::string_view text_;
  std::vector<const Json*> scopes_;
  std::string out_;
  std::size_t at_ = 0;
};

}  // namespace

Expected<std::string> render(std::string_view text, const Json& view) {
  try {
    return Template(text, view).whole();
  } catch (const BadTemplate& bad) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(bad.at), '\n');
    return fail(bad.what, fmt::format("template:{}", line), "mend the template or what fills it");
  }
}

}  // namespace pons::record
