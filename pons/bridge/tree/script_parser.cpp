// Text to Script: a lexer, and a parser by precedence climbing (Pratt 1973).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <utility>

#include "pons/bridge/tree/script.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

constexpr int kMostNesting = 64;
// 1 + 1 + 1 … is as deep as it is long to who evaluates it.
constexpr int kMostOperators = 256;

struct Token {
  enum class Kind : std::uint8_t { kEnd, kName, kNumber, kText, kSign };
  Kind kind = Kind::kEnd;
  std::string_view text;  // of a text, between its quotes
  std::size_t at = 0;
};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

struct Infix {
  std::string_view sign;
  int binds;  // tighter the higher
  Operator op;
};
// Precedences as in BehaviorTree.CPP, where bits bind tighter than comparisons.
constexpr int kAssignments = 1, kConditions = 2, kComparisons = 5, kPrefixes = 10;
constexpr std::array kInfixes{Infix{":=", kAssignments, Operator::kCreate},
                              Infix{"+=", kAssignments, Operator::kAddTo},
                              Infix{"-=", kAssignments, Operator::kTakeFrom},
                              Infix{"*=", kAssignments, Operator::kMultiplyBy},
                              Infix{"/=", kAssignments, Operator::kDivideBy},
                              Infix{"=", kAssignments, Operator::kAssign},
                              Infix{"?", kConditions, Operator::kIf},
                              Infix{"||", 3, Operator::kOr},
                              Infix{"&&", 4, Operator::kAnd},
                              Infix{"==", kComparisons, Operator::kEqual},
                              Infix{"!=", kComparisons, Operator::kUnequal},
                              Infix{"<=", kComparisons, Operator::kLessEqual},
                              Infix{">=", kComparisons, Operator::kGreaterEqual},
                              Infix{"<", kComparisons, Operator::kLess},
                              Infix{">", kComparisons, Operator::kGreater},
                              Infix{"|", 6, Operator::kBitOr},
                              Infix{"^", 6, Operator::kBitXor},
                              Infix{"&", 7, Operator::kBitAnd},
                              Infix{"+", 8, Operator::kPlus},
                              Infix{"-", 8, Operator::kMinus},
                              Infix{"..", 8, Operator::kJoin},
                              Infix{"*", 9, Operator::kTimes},
                              Infix{"/", 9, Operator::kDivide}};

const Infix* infix(const Token& token) {
  if (token.kind != Token::Kind::kSign) return nullptr;
  const auto found = std::ranges::find(kInfixes, token.text, &Infix::sign);
  return found == kInfixes.end() ? nullptr : &*found;
}

// Of 0x1F, 12, 1.5, 2e-3; as many characters as belong to it, right or wrong.
std::size_t number_length(std::string_view text) {
  std::size_t i = 0;
  const bool hex = text.starts_with("0x") || text.starts_with("0X");
  for (; i < text.size(); ++i) {
    const char c = text[i];
    const bool exponent_sign = !hex && (c == '+' || c == '-') && i > 0 && (text[i - 1] == 'e' || text[i - 1] == 'E');
    if (c == '.' && i + 1 < text.size() && text[i + 1] == '.') break;  // 1..'a' joins
    if (!is_digit(c) && !is_letter(c) && c != '.' && !exponent_sign) break;
  }
  return i;
}

// Of speed, @speed, object.mass_kg; two dots join texts.
std::size_t name_length(std::string_view text) {
  std::size_t i = 1;
  for (; i < text.size(); ++i) {
    const bool part_begins = text[i] == '.' && i + 1 < text.size() && is_letter(text[i + 1]);
    if (!is_letter(text[i]) && !is_digit(text[i]) && !part_begins) break;
  }
  return i;
}

std::optional<Value> number(std::string_view text) {
  const char* const end = text.data() + text.size();
  if (text.starts_with("0x") || text.starts_with("0X")) {
    std::int64_t bits = 0;
    const auto read = std::from_chars(text.data() + 2, end, bits, 16);
    return read.ec == std::errc() && read.ptr == end ? std::optional<Value>(bits) : std::nullopt;
  }
  if (std::ranges::all_of(text, is_digit)) {
    std::int64_t integer = 0;
    return std::from_chars(text.data(), text.data() + text.size(), integer).ec == std::errc()
               ? std::optional<Value>(integer)
               : std::nullopt;
  }
  double real = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), real);
  const bool good = read.ec == std::errc() && read.ptr == end && text.back() != '.';
  return good ? std::optional<Value>(real) : std::nullopt;
}

}  // namespace

class Script::Parser {
 public:
  Parser(std::string_view text, const SlotOf& slot_of, Script& script)
      : text_(text), slot_of_(slot_of), script_(script) {}

  Expected<void> parse() {
    if (auto first = advance(); !first) return first;
    while (token_.kind != Token::Kind::kEnd) {
      const auto statement = expression(0, 0);
      if (!statement) return std::unexpected(statement.error());
      script_.statements_.push_back(*statement);
      while (is(";")) {
        if (auto next = advance(); !next) return next;
      }
    }
    if (script_.statements_.empty()) return fail("the script is empty", {}, "write a statement, or leave it out");
    return {};
  }

 private:
  using Index = Expected<std::int32_t>;

  [[nodiscard]] bool is(std::string_view sign) const {
    return token_.kind == Token::Kind::kSign && token_.text == sign;
  }
  [[nodiscard]] std::unexpected<Error> wrong(std::string_view what) const {
    return fail(fmt::format("{} at character {} of the script '{}'", what, token_.at + 1, task::excerpt(text_, 120)),
                {}, "write it as BehaviorTree.CPP's scripts are written");
  }

  Expected<void> take(Token::Kind kind, std::size_t length) {
    token_ = {kind, text_.substr(next_, length), next_};
    next_ += length;
    return {};
  }
  Expected<void> advance() {
    while (next_ < text_.size() && std::string_view(" \t\r\n").find(text_[next_]) != std::string_view::npos) ++next_;
    const std::string_view rest = text_.substr(next_);
    if (rest.empty()) return take(Token::Kind::kEnd, 0);
    if (is_digit(rest[0])) return take(Token::Kind::kNumber, number_length(rest));
    if (is_letter(rest[0]) || rest[0] == '@') {
      return take(Token::Kind::kName, name_length(rest));
    }
    if (rest[0] == '\'' || rest[0] == '"') {
      const std::size_t end = rest.find(rest[0], 1);
      token_.at = next_;
      if (end == rest.npos) return wrong("a text without its end");
      token_ = {Token::Kind::kText, rest.substr(1, end - 1), next_};
      next_ += end + 1;
      return {};
    }
    const bool two = rest.size() > 1 && (rest[1] == '=' || rest[1] == rest[0]) &&
                     infix({Token::Kind::kSign, rest.substr(0, 2), 0}) != nullptr;
    return take(Token::Kind::kSign, two ? 2 : 1);
  }

  Index add(Expression made, std::string name = {}) {
    int depth = 0;
    for (const std::int32_t operand : {made.left, made.right, made.third}) {
      if (operand >= 0) depth = std::max(depth, depths_[static_cast<std::size_t>(operand)] + 1);
    }
    if (depth > kMostOperators) return wrong(fmt::format("more than {} operators in one another", kMostOperators));
    depths_.push_back(depth);
    script_.expressions_.push_back(std::move(made));
    script_.names_.push_back(std::move(name));
    return static_cast<std::int32_t>(script_.expressions_.size() - 1);
  }
  Index literal(Value value) {
    if (auto next = advance(); !next) return std::unexpected(next.error());
    return add({.literal = std::move(value)});
  }

  Index expression(int binds, int depth) {
    if (depth > kMostNesting) return wrong("too deep a nesting");
    Index left = prefix(depth);
    while (left) {
      const Infix* const sign = infix(token_);
      if (sign == nullptr || sign->binds < binds) break;
      if (sign->binds == kAssignments) return assignment(*left, sign->op, depth);
      if (sign->binds == kConditions) return condition(*left, depth);
      left = sign->binds == kComparisons ? comparison(*left, depth) : arithmetic(*left, *sign, depth);
    }
    return left;
  }

  Index prefix(int depth) {
    const Token token = token_;
    if (token.kind == Token::Kind::kNumber) {
      auto value = number(token.text);
      return value ? literal(*std::move(value)) : Index(wrong("no number"));
    }
    if (token.kind == Token::Kind::kText) return literal(std::string(token.text));
    if (token.kind == Token::Kind::kName && (token.text == "true" || token.text == "false"))
      return literal(token.text == "true" ? 1.0 : 0.0);
    if (token.kind == Token::Kind::kName) return variable(token.text);
    if (is("-")) return unary(Operator::kNegate, depth);
    if (is("~")) return unary(Operator::kComplement, depth);
    if (is("!")) return unary(Operator::kNot, depth);
    if (!is("(")) return wrong(token.kind == Token::Kind::kEnd ? "a value is missing" : "no value");
    if (auto next = advance(); !next) return std::unexpected(next.error());
    Index inner = expression(0, depth + 1);
    if (!inner) return inner;
    if (!is(")")) return wrong("')' is missing");
    if (auto next = advance(); !next) return std::unexpected(next.error());
    return inner;
  }

  Index variable(std::string_view name) {
    const auto slot = slot_of_(name);
    if (!slot) return std::unexpected(slot.error());
    if (auto next = advance(); !next) return std::unexpected(next.error());
    return add({.op = Operator::kVariable, .slot = *slot}, task::excerpt(name));
  }
  Index unary(Operator op, int depth) {
    if (auto next = advance(); !next) return std::unexpected(next.error());
    const Index operand = expression(kPrefixes, depth + 1);
    return operand ? add({.op = op, .left = *operand}) : operand;
  }
  Index arithmetic(std::int32_t left, const Infix& sign, int depth) {
    if (auto next = advance(); !next) return std::unexpected(next.error());
    const Index right = expression(sign.binds + 1, depth + 1);
    return right ? add({.op = sign.op, .left = left, .right = *right}) : right;
  }
  Index assignment(std::int32_t left, Operator op, int depth) {
    const Expression to = script_.expressions_[static_cast<std::size_t>(left)];
    if (to.op != Operator::kVariable) return wrong("only a variable can be assigned to");
    if (auto next = advance(); !next) return std::unexpected(next.error());
    const Index right = expression(0, depth + 1);
    return right ? add({.op = op, .left = left, .right = *right, .slot = to.slot}) : right;
  }
  Index condition(std::int32_t left, int depth) {
    if (auto next = advance(); !next) return std::unexpected(next.error());
    const Index then = expression(0, depth + 1);
    if (!then) return then;
    if (!is(":")) return wrong("':' is missing");
    if (auto next = advance(); !next) return std::unexpected(next.error());
    const Index other = expression(kConditions, depth + 1);
    return other ? add({.op = Operator::kIf, .left = left, .right = *then, .third = *other}) : other;
  }
  // a < b <= c: each with its neighbour.
  Index comparison(std::int32_t first, int depth) {
    const Index chain = add({.op = Operator::kCompare, .left = first});
    if (!chain) return chain;
    std::int32_t last = -1;
    for (const Infix* sign = infix(token_); sign != nullptr && sign->binds == kComparisons; sign = infix(token_)) {
      if (auto next = advance(); !next) return std::unexpected(next.error());
      const Index operand = expression(kComparisons + 1, depth + 1);
      if (!operand) return operand;
      const Index link = add({.op = sign->op, .left = *operand});
      if (!link) return link;
      int& deepest = depths_[static_cast<std::size_t>(*chain)];
      deepest = std::max(deepest, depths_[static_cast<std::size_t>(*link)]);
      auto& before = script_.expressions_[static_cast<std::size_t>(last < 0 ? *chain : last)];
      (last < 0 ? before.right : before.third) = *link;
      last = *link;
    }
    return chain;
  }

  std::string_view text_;
  const SlotOf& slot_of_;
  Script& script_;
  std::vector<int> depths_;  // by expression
  Token token_;
  std::size_t next_ = 0;
};

Expected<Script> Script::parse(std::string_view text, const SlotOf& slot_of) {
  Script script;
  script.text_ = text;
  if (auto parsed = Parser(text, slot_of, script).parse(); !parsed) return std::unexpected(parsed.error());
  return script;
}

}  // namespace pons::bridge::tree
