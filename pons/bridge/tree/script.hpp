// The scripting language of BehaviorTree.CPP 4: statements apart by ';', variables of the blackboard, := = += -= *= /=,
// ?:, || &&, comparisons in chains, | ^ & ~, + - * /, .. to join text, numbers, 'text', true and false.
//
// A name may have parts, as in object.mass_kg. Both sides of && and || are evaluated. Equal are numbers within the
// epsilon of a float, as there. Enumerations are not known: a name is a variable.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/tree/blackboard.hpp"
#include "pons/bridge/tree/value.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge::tree {

// Of a text that a script joins: one that doubles itself in a loop must not take all the memory there is.
inline constexpr std::size_t kMaxTextBytes = 16 * 1024;

enum class Operator : std::uint8_t {
  kLiteral,
  kVariable,
  kNegate,
  kComplement,
  kNot,
  kPlus,
  kMinus,
  kTimes,
  kDivide,
  kJoin,
  kBitAnd,
  kBitOr,
  kBitXor,
  kAnd,
  kOr,
  kEqual,
  kUnequal,
  kLess,
  kGreater,
  kLessEqual,
  kGreaterEqual,
  kCompare,  // left: the first operand; right: a link, which is a comparison with its left and has the next as its
             // third
  kIf,       // left ? right : third
  kCreate,   // the assignments' left is a variable
  kAssign,
  kAddTo,
  kTakeFrom,
  kMultiplyBy,
  kDivideBy,
};

struct Expression {
  Operator op = Operator::kLiteral;
  std::int32_t left = -1, right = -1, third = -1;
  std::int32_t slot = -1;  // of a variable
  Value literal = {};
};

class Script {
 public:
  // Says which slot a variable has; the name may begin with '@' (the root's).
  using SlotOf = std::function<Expected<int>(std::string_view name)>;

  Script() = default;
  // Error: the text is no script; says where. Nesting is bounded.
  [[nodiscard]] static Expected<Script> parse(std::string_view text, const SlotOf& slot_of);

  // The value of its last statement. Error: a variable that does not exist or is not set, types that do not fit, a
  // number that would lose digits in an entry that holds integers, a text that would be too long, or more than a
  // blackboard holds or handles. What was assigned until then stays assigned. Allocates nothing but long texts.
  [[nodiscard]] Expected<Value> run(Blackboard& board) const;
  // Likewise, as a truth value.
  [[nodiscard]] Expected<bool> holds(Blackboard& board) const;
  // Whether it is one statement that writes to no variable.
  [[nodiscard]] bool is_condition() const;
  // The slots that it reads, but for what an assignment adds to and the like; and those that it assigns to.
  [[nodiscard]] std::vector<std::int32_t> reads() const;
  [[nodiscard]] std::vector<std::int32_t> writes() const;
  // Each variable that is held against a text, whether it is that or not.
  struct Equated {
    std::int32_t slot;
    std::string text;
  };
  [[nodiscard]] std::vector<Equated> equated() const;
  // How much there is to do.
  [[nodiscard]] std::size_t size() const { return expressions_.size(); }

 private:
  class Parser;
  [[nodiscard]] Expected<Value> value(std::int32_t index, Blackboard& board) const;
  [[nodiscard]] Expected<Value> binary(const Expression& expression, Blackboard& board) const;
  [[nodiscard]] Expected<Value> unary(const Expression& expression, Blackboard& board) const;
  [[nodiscard]] Expected<Value> compare(const Expression& expression, Blackboard& board) const;
  [[nodiscard]] Expected<Value> assign(const Expression& expression, Blackboard& board) const;
  [[nodiscard]] Expected<Value> joined(const std::string& left, const std::string& right, Blackboard& board) const;
  [[nodiscard]] std::unexpected<Error> wrong(std::string what) const;

  std::vector<Expression> expressions_;
  std::vector<std::int32_t> statements_;
  std::vector<std::string> names_;  // of the variables, by expression
  std::string text_;
};

}  // namespace pons::bridge::tree
