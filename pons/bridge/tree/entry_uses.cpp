#include "pons/bridge/tree/entry_uses.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

namespace pons::bridge::tree {
namespace {

struct Assigned {
  bool makes = false;        // ":="
  bool text = false;         // of a literal
  bool may_be_text = false;  // of anything but a number's literal
};

// Of each assignment in a script that can be read, in their order.
std::vector<Assigned> assignments_in(std::string_view script) {
  std::vector<Assigned> all;
  bool quoted = false;
  for (std::size_t i = 1; i + 1 < script.size(); ++i) {
    if (script[i] == '\'') quoted = !quoted;
    if (quoted || script[i] != '=') continue;
    if (script[i + 1] == '=') {
      ++i;
      continue;
    }
    if (std::string_view("!<>").contains(script[i - 1])) continue;
    const std::size_t begin = std::min(script.find_first_not_of(" \t\r\n", i + 1), script.size() - 1);
    const char first = script[begin];
    const bool plain = script[i - 1] == ':' || !std::string_view("+-*/").contains(script[i - 1]);
    all.push_back({script[i - 1] == ':', plain && first == '\'', first < '0' || first > '9'});
  }
  return all;
}

}  // namespace

void EntryUses::read(std::int32_t slot, const std::string& where) {
  if (!std::exchange(of(slot).known, true)) read_.emplace_back(slot, where);
}

void EntryUses::by(const Script& script, std::string_view text, const std::string& where) {
  for (const std::int32_t slot : script.reads()) {
    read(slot, where);
    of(slot).in_script = true;
  }
  const auto slots = script.writes();
  auto assigned = assignments_in(text);
  assigned.resize(slots.size());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    Use& use = of(slots[i]);
    use.set = use.in_script = use.by_script = true;
    use.made = use.made || assigned[i].makes;
    use.texts = use.texts || assigned[i].may_be_text;
    if (assigned[i].text) writings_.push_back({slots[i], By::kScript, where});
  }
}

void EntryUses::port(std::int32_t slot, const PortType& type, Loop::Of loop, const std::string& where) {
  if (type.of == PortType::Of::kOut) {
    set(slot);
    writings_.push_back({slot, By::kLoop, where});
  } else {
    read(slot, where);
  }
  const Type before = of(slot).given, now = type_of(type, loop);
  // A text is read as whatever a port takes, and nothing else is written over it.
  const bool reads_text = before == Type::kText && type.of != PortType::Of::kOut;
  const bool any = before == Type::kNone || before == Type::kNumber || before >= Type::kOpen || now >= Type::kOpen;
  const bool clash = !any && !reads_text && now != before;
  if (clash && two_types_.empty()) two_types_ = where;
  give(slot, now);
}

EntryUses::Type EntryUses::type_of(const PortType& type, Loop::Of loop) {
  switch (type.of) {
    case PortType::Of::kInteger:
      return Type::kInteger;
    case PortType::Of::kUnsigned:
      return Type::kUnsigned;
    case PortType::Of::kValue:
    case PortType::Of::kQueue:
      return Type::kOpen;
    case PortType::Of::kOut:
      return loop == Loop::Of::kInteger   ? Type::kInteger
             : loop == Loop::Of::kBoolean ? Type::kBoolean
             : loop == Loop::Of::kReal    ? Type::kReal
                                          : Type::kText;
    default:
      return Type::kText;
  }
}

// Of what type the port of such a skill would be there: as its schema says, if that is of numbers.
void EntryUses::argument(std::int32_t slot, const Json& schema, const std::string& where) {
  read(slot, where);
  const std::string type = task::text_of(schema, "type");
  give(slot, type == "number" || type == "integer" || type == "boolean" ? Type::kNumber : Type::kText);
}

// Nothing says of what type it is: a number does most harm.
void EntryUses::output(std::int32_t slot) {
  set(slot);
  give(slot, Type::kNumber);
}

void EntryUses::constant(std::int32_t slot, const Value& value) {
  set(slot);
  of(slot).texts = is_text(value);
  const bool real = std::holds_alternative<double>(value);
  give(slot, !tree::is_number(value) ? Type::kOpen : (real ? Type::kReal : Type::kInteger));
}

void EntryUses::set_to(std::int32_t slot, const Port& value, const std::string& where) {
  set(slot);
  const bool copies = value.slot >= 0;
  of(slot).copied = of(slot).copied || copies;
  of(slot).texts = of(slot).texts || !copies || of(value.slot).may_be_text();
  writings_.push_back({slot, By::kSetBlackboard, where, value});
}

void EntryUses::give(std::int32_t slot, Type type) {
  Type& given = of(slot).given;
  if (given == Type::kNone) given = type;
}

std::vector<std::pair<std::int32_t, std::string>> EntryUses::unset() const {
  std::vector<std::pair<std::int32_t, std::string>> unset;
  std::ranges::copy_if(read_, std::back_inserter(unset),
                       [this](const auto& each) { return !uses_.at(each.first).set; });
  return unset;
}

const std::string* EntryUses::retyped() const {
  for (const Writing& each : writings_) {
    const Use& to = uses_.at(each.slot);
    const auto* const text = std::get_if<std::string>(&each.value.literal);
    bool differs = false;
    if (each.by == By::kLoop) {
      differs = to.by_script;  // which may make it a number of another type
    } else if (each.by == By::kScript) {
      differs = is_number(to.given) || to.given == Type::kWatched;
    } else if (each.value.slot >= 0) {
      differs = copy_differs(to, uses_.at(each.value.slot));
    } else {
      differs = text != nullptr && text_differs(to, *text);
    }
    if (differs) return &each.where;
  }
  return nullptr;
}

// What is copied has a type of its own, which must be that of the entry. A text that is of none is lost.
bool EntryUses::copy_differs(const Use& to, const Use& from) {
  const bool lost = from.type() >= Type::kOpen && from.may_be_text();
  if (to.type() == Type::kNone) return lost;
  return to.type() >= Type::kOpen ? lost || from.type() == Type::kText : from.type() != to.type();
}

// Ports here read a number from the text; to a script it is a text.
bool EntryUses::text_differs(const Use& to, const std::string& text) {
  const bool number = tree::is_number(value_of_literal(text));
  switch (to.type()) {
    case Type::kNone:
      return to.copied;  // with its type
    case Type::kText:
      return false;
    case Type::kInteger:
    case Type::kUnsigned:
      return to.in_script || !integer_of(Value(text));
    case Type::kReal:
      return to.in_script || !number;
    case Type::kBoolean:
      return to.in_script || !boolean_of(text);
    case Type::kNumber:
      return to.in_script && number;
    default:
      return true;
  }
}

}  // namespace pons::bridge::tree
