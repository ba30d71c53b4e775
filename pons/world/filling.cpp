#include "pons/world/filling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/world/sections.hpp"

namespace pons::world {
namespace {

constexpr int kDeepest = 16;
constexpr std::size_t kMostMembers = 256, kLongestText = 1000;

class Reader {
 public:
  explicit Reader(const BetweenBraces& between) : between_(between) {}

  Filling read(const YamlValue& value, int depth) const {
    Filling filling{.where = value.place()};
    if (depth > kDeepest) value.refuse("is too deep", fmt::format("at most {} inside one another", kDeepest));
    if (value.node().IsSequence()) {
      filling.kind = Filling::Kind::kElements;
      for (const YamlValue& element : value.list(0, kMostMembers)) filling.parts.push_back(read(element, depth + 1));
      return filling;
    }
    if (value.node().IsMap()) {
      for (const auto& [name, member] : value.members(kMostMembers)) {
        // As YAML has it, {x} is a mapping with an empty x.
        if (member.node().IsNull())
          member.refuse("is empty", fmt::format("write \"{{{}}}\", in quotes, for what is to stand there", name));
        filling.parts.push_back(read(member, depth + 1));
        filling.parts.back().name = name;
      }
      return filling;
    }
    const bool quoted = value.node().IsScalar() && value.node().Tag() == "!";
    const std::string text = quoted ? value.node().Scalar() : value.text();
    if (text.size() > kLongestText)
      value.refuse(fmt::format("has {} characters", text.size()), fmt::format("write at most {}", kLongestText));
    if (quoted || text.find_first_of("{}") != text.npos) {
      filling.kind = Filling::Kind::kText;
      filling.pieces = pieces(value, text);
    } else {
      filling.kind = Filling::Kind::kWord;
      filling.word = text;
    }
    return filling;
  }

 private:
  std::vector<Piece> pieces(const YamlValue& value, std::string_view text) const {
    std::vector<Piece> found;
    std::string plain;
    const auto end_plain = [&] {
      if (!plain.empty()) found.push_back({Piece::Kind::kText, std::exchange(plain, {})});
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool brace = text[i] == '{' || text[i] == '}';
      if (brace && i + 1 < text.size() && text[i + 1] == text[i]) {
        plain += text[i++];
      } else if (!brace) {
        plain += text[i];
      } else {
        const std::size_t close = text.find('}', i);
        if (text[i] == '}' || close == text.npos)
          value.refuse("has a brace without its other", "write {{ and }} for braces that stand for themselves");
        end_plain();
        found.push_back(between_(value, text.substr(i + 1, close - i - 1)));
        i = close;
      }
    }
    end_plain();
    if (found.empty()) found.push_back({});
    if (found.size() > 1 && std::ranges::find(found, Piece::Kind::kQuaternion, &Piece::kind) != found.end())
      value.refuse("has more beside a quaternion", "it is a value of its own");
    return found;
  }

  const BetweenBraces& between_;
};

}  // namespace

Filling read_filling(const YamlValue& value, const BetweenBraces& between) { return Reader(between).read(value, 1); }

}  // namespace pons::world
