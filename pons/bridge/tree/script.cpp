#include "pons/bridge/tree/script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

Value truth(bool holds) { return holds ? 1.0 : 0.0; }

// Nothing that is negative is a truth value, nor an integer above 1, as there.
std::optional<bool> truth_of(const Value& value) {
  if (!is_number(value) || number_of(value) < 0) return {};
  if (const auto* integer = std::get_if<std::int64_t>(&value); integer != nullptr && *integer > 1) return {};
  return number_of(value) != 0;
}

template <typename Left, typename Right>
bool holds_of(Operator op, const Left& left, const Right& right, bool same) {
  switch (op) {
    case Operator::kEqual:
      return same;
    case Operator::kUnequal:
      return !same;
    case Operator::kLess:
      return !(left >= right);
    case Operator::kGreater:
      return !(left <= right);
    case Operator::kLessEqual:
      return !(left > right);
    default:
      return !(left < right);
  }
}

std::optional<double> calculate(Operator op, double left, double right) {
  switch (op) {
    case Operator::kPlus:
    case Operator::kAddTo:
      return left + right;
    case Operator::kMinus:
    case Operator::kTakeFrom:
      return left - right;
    case Operator::kTimes:
    case Operator::kMultiplyBy:
      return left * right;
    case Operator::kDivide:
    case Operator::kDivideBy:
      return left / right;
    default:
      return {};
  }
}

std::int64_t combine(Operator op, std::int64_t left, std::int64_t right) {
  if (op == Operator::kBitAnd) return left & right;
  return op == Operator::kBitOr ? left | right : left ^ right;
}

// The right side of an assignment into an entry that has a value: the entry keeps its kind. Nothing: it cannot.
std::optional<Value> fitted(const Value& to, Value value) {
  if (is_number(to)) {
    const auto number = to_number(value);
    if (!number) return {};
    // A text that becomes a number becomes a real one, as there.
    if (is_text(value) || std::holds_alternative<double>(to)) return *number;
    const auto integer = integer_of(value);
    return integer ? std::optional<Value>(*integer) : std::nullopt;
  }
  if (to.index() != value.index()) return {};
  return value;
}

}  // namespace

std::unexpected<Error> Script::wrong(std::string what) const {
  return fail(fmt::format("{} in the script '{}'", what, task::excerpt(text_, 120)));
}

Expected<Value> Script::joined(const std::string& left, const std::string& right, Blackboard& board) const {
  const std::size_t bytes = left.size() + right.size();
  if (bytes > kMaxTextBytes) return wrong(fmt::format("a text would have more than {} bytes", kMaxTextBytes));
  if (auto handled = board.handle(bytes); !handled) return std::unexpected(handled.error());
  return left + right;
}

Expected<Value> Script::run(Blackboard& board) const {
  Expected<Value> result{Value{}};
  for (const std::int32_t statement : statements_) {
    result = value(statement, board);
    if (!result) break;
  }
  return result;
}

Expected<bool> Script::holds(Blackboard& board) const {
  const auto result = run(board);
  if (!result) return std::unexpected(result.error());
  const auto held = truth_of(*result);
  if (!held) return wrong(fmt::format("{} is no truth value", kind_of(*result)));
  return *held;
}

Expected<Value> Script::value(std::int32_t index, Blackboard& board) const {
  const Expression& expression = expressions_[static_cast<std::size_t>(index)];
  switch (expression.op) {
    case Operator::kLiteral:
      return expression.literal;
    case Operator::kVariable: {
      const Slot& slot = board[expression.slot];
      if (!slot.exists) return wrong(fmt::format("there is no '{}'", names_[static_cast<std::size_t>(index)]));
      if (auto handled = board.handle(bytes_of(slot.value)); !handled) return std::unexpected(handled.error());
      return slot.value;
    }
    case Operator::kNegate:
    case Operator::kComplement:
    case Operator::kNot:
      return unary(expression, board);
    case Operator::kCompare:
      return compare(expression, board);
    case Operator::kIf: {
      const auto condition = value(expression.left, board);
      if (!condition) return condition;
      const auto number = to_number(*condition);
      if (!number) return wrong(fmt::format("{} is no truth value", kind_of(*condition)));
      return value(*number != 0 ? expression.right : expression.third, board);
    }
    case Operator::kCreate:
    case Operator::kAssign:
    case Operator::kAddTo:
    case Operator::kTakeFrom:
    case Operator::kMultiplyBy:
    case Operator::kDivideBy:
      return assign(expression, board);
    default:
      return binary(expression, board);
  }
}

Expected<Value> Script::unary(const Expression& expression, Blackboard& board) const {
  const auto operand = value(expression.left, board);
  if (!operand) return operand;
  if (!is_number(*operand)) return wrong(fmt::format("{} has no sign and no opposite", kind_of(*operand)));
  const double number = number_of(*operand);
  if (expression.op == Operator::kNegate) return -number;
  if (expression.op == Operator::kNot) return truth(number == 0);
  const auto bits = integer_of(std::trunc(number));
  if (!bits) return wrong("a number is too large for '~'");
  return static_cast<double>(~*bits);
}

Expected<Value> Script::binary(const Expression& expression, Blackboard& board) const {
  const auto left = value(expression.left, board);
  if (!left) return left;
  const auto right = value(expression.right, board);
  if (!right) return right;
  if (is_empty(*left) || is_empty(*right)) return wrong("a variable is used that is not set");
  const bool texts = is_text(*left) && is_text(*right);
  if (is_number(*left) && is_number(*right)) {
    if (const auto result = calculate(expression.op, number_of(*left), number_of(*right))) return *result;
    if (expression.op == Operator::kJoin) return wrong("two numbers cannot be joined");
    if (expression.op == Operator::kAnd || expression.op == Operator::kOr) {
      const auto a = truth_of(*left), b = truth_of(*right);
      if (!a || !b) return wrong("a negative number, or an integer above 1, is no truth value");
      return truth(expression.op == Operator::kAnd ? *a && *b : *a || *b);
    }
    const auto left_bits = integer_of(*left), right_bits = integer_of(*right);
    if (!left_bits || !right_bits) return wrong("bits are of integers only");
    return static_cast<double>(combine(expression.op, *left_bits, *right_bits));
  }
  const bool joins = expression.op == Operator::kJoin && (is_text(*left) || is_text(*right)) &&
                     (is_text(*left) || is_number(*left)) && (is_text(*right) || is_number(*right));
  if (joins || (texts && expression.op == Operator::kPlus)) return joined(to_text(*left), to_text(*right), board);
  return wrong(fmt::format("{} and {} cannot be combined like that", kind_of(*left), kind_of(*right)));
}

Expected<Value> Script::compare(const Expression& expression, Blackboard& board) const {
  auto left = value(expression.left, board);
  if (!left) return left;
  for (std::int32_t next = expression.right; next >= 0;) {
    const Expression& link = expressions_[static_cast<std::size_t>(next)];
    auto right = value(link.left, board);
    if (!right) return right;
    if (is_empty(*left) || is_empty(*right)) return wrong("a variable is compared that is not set");
    bool holds = false;
    if (is_text(*left) && is_text(*right)) {
      holds = holds_of(link.op, std::get<std::string>(*left), std::get<std::string>(*right), *left == *right);
    } else {
      const auto a = to_number(*left), b = to_number(*right);
      if (!a || !b) return wrong(fmt::format("{} cannot be compared with {}", kind_of(*left), kind_of(*right)));
      holds = holds_of(link.op, *a, *b, same_number(*a, *b));
    }
    if (!holds) return truth(false);
    left = std::move(right);
    next = link.third;
  }
  return truth(true);
}

bool Script::is_condition() const {
  return statements_.size() == 1 &&
         std::ranges::none_of(expressions_, [](const Expression& each) { return each.op >= Operator::kCreate; });
}

std::vector<std::int32_t> Script::reads() const {
  std::vector<bool> assigned(expressions_.size());
  for (const Expression& each : expressions_) {
    if (each.op >= Operator::kCreate) assigned[static_cast<std::size_t>(each.left)] = true;
  }
  std::vector<std::int32_t> slots;
  for (std::size_t i = 0; i < expressions_.size(); ++i) {
    if (expressions_[i].op == Operator::kVariable && !assigned[i]) slots.push_back(expressions_[i].slot);
  }
  return slots;
}

std::vector<std::int32_t> Script::writes() const {
  std::vector<std::int32_t> slots;
  for (const Expression& each : expressions_) {
    if (each.op >= Operator::kCreate) slots.push_back(each.slot);
  }
  return slots;
}

std::vector<Script::Equated> Script::equated() const {
  const auto at = [this](std::int32_t index) -> const Expression& {
    return expressions_[static_cast<std::size_t>(index)];
  };
  std::vector<Equated> all;
  for (const Expression& each : expressions_) {
    if (each.op != Operator::kCompare) continue;
    const Expression* left = &at(each.left);
    for (std::int32_t next = each.right; next >= 0; next = at(next).third) {
      const Expression& link = at(next);
      const Expression* const right = &at(link.left);
      const bool equates = link.op == Operator::kEqual || link.op == Operator::kUnequal;
      const auto [variable, word] = left->op == Operator::kVariable ? std::pair(left, right) : std::pair(right, left);
      if (equates && variable->op == Operator::kVariable && word->op == Operator::kLiteral && is_text(word->literal))
        all.push_back({variable->slot, std::get<std::string>(word->literal)});
      left = right;
    }
  }
  return all;
}

Expected<Value> Script::assign(const Expression& expression, Blackboard& board) const {
  const Slot& slot = board[expression.slot];
  const std::string& name = names_[static_cast<std::size_t>(expression.left)];
  const Operator op = expression.op;
  if (!slot.exists && op != Operator::kCreate) return wrong(fmt::format("there is no '{}' yet (':=' makes one)", name));
  board.make(expression.slot);
  auto given = value(expression.right, board);
  if (!given) return given;
  if (is_empty(*given)) return wrong("a variable is assigned that is not set");
  if (op != Operator::kCreate && op != Operator::kAssign) {
    if (is_empty(slot.value)) return wrong(fmt::format("'{}' is not set", name));
    if (is_number(slot.value) && is_number(*given)) {
      given = calculate(op, number_of(slot.value), number_of(*given)).value_or(0);
    } else if (is_text(slot.value) && is_text(*given) && op == Operator::kAddTo) {
      given = joined(std::get<std::string>(slot.value), std::get<std::string>(*given), board);
      if (!given) return given;
    } else {
      return wrong(fmt::format("{} and {} cannot be combined like that", kind_of(slot.value), kind_of(*given)));
    }
  }
  if (!is_empty(slot.value)) {
    auto kept = fitted(slot.value, *given);
    if (!kept) return wrong(fmt::format("'{}' holds {}, and cannot take this", name, kind_of(slot.value)));
    given = *std::move(kept);
  }
  if (auto written = board.write(expression.slot, *given); !written) return std::unexpected(written.error());
  return given;
}

}  // namespace pons::bridge::tree
