#include "pons/bridge/tree/differences.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pons/bridge/tree/markup.hpp"
#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/task/json_text.hpp"

namespace pons::bridge::tree {
namespace {

bool makes_something_of_failure(Kind kind) {
  switch (kind) {
    case Kind::kFallback:
    case Kind::kAsyncFallback:
    case Kind::kReactiveFallback:
    case Kind::kTryCatch:
    case Kind::kInverter:
    case Kind::kForceSuccess:
    case Kind::kRetry:
      return true;
    default:
      return false;
  }
}

}  // namespace

void Differences::add(std::string_view where, std::string_view what) {
  if (lines_.size() < kMost) {
    lines_.push_back(fmt::format("{}: {}", where, what));
  } else {
    ++more_;
  }
}

void Differences::Above::count(Kind kind, const Element& element, int by) {
  if (may_halt(kind) || element.attribute("_while") != nullptr) halting += by;
  if (makes_something_of_failure(kind)) catching += by;
  if (kind == Kind::kParallel || kind == Kind::kParallelAll) beside += by;
}

void Differences::tell(Sort sort, std::string_view where, std::string_view what) {
  if (told_.insert(sort).second) add(where, what);
}

void Differences::look(const Element& element, Kind kind, const Above& above) {
  const auto tell = [&](Sort sort, std::string_view what) { this->tell(sort, element.where, what); };
  if (kind == Kind::kSkill && above.halting > 0)
    tell(Sort::kSkill,
         "a skill that a node above halts leaves the world safe first, while the tree goes on; what needs the same "
         "waits");
  if (kind == Kind::kSkill && above.catching > 0)
    tell(Sort::kException,
         "an exception of a skill (handled, but not as asked) ends the whole tree; no node above catches it");
  if (kind == Kind::kSkill && above.beside > 0)
    tell(Sort::kBeside, "skills that run at the same time and need the same resource wait for one another");
  if (waits(kind)) tell(Sort::kTime, "time stands while the task is paused, and while the robot is stopped");
  if (kind == Kind::kPrecondition && above.halting > 0)
    tell(Sort::kPrecondition,
         "a Precondition that was halted asks its condition anew; there it goes on as if that held");
  const auto asynchronous = std::ranges::count(element.children, "AsyncSequence", &Element::tag);
  if (kind == Kind::kReactiveSequence && asynchronous > 1)
    tell(Sort::kReactive, "more than one AsyncSequence in a ReactiveSequence; BehaviorTree.CPP refuses that");
}

void Differences::look_at_key(const Element& element, bool in_braces, bool leads_out) {
  if (in_braces) {
    tell(Sort::kKeyRead, element.where,
         "an UnsetBlackboard's key in braces names what is unset; there the entry is read, and what it holds is the "
         "name");
  } else if (leads_out) {
    tell(Sort::kKeyElsewhere, element.where,
         "UnsetBlackboard unsets an entry wherever it stands; there only one of the tree's own blackboard");
  }
}

void Differences::look(const EntryUses& uses) {
  if (const std::string* const where = uses.retyped(); where != nullptr) {
    tell(Sort::kType, *where,
         "an entry holds whatever is written to it; there it keeps the type that a port or a script gave it: a text "
         "becomes a number, or is lost, and what does not fit ends the tree");
  }
  if (!uses.two_types().empty()) {
    tell(Sort::kTwoTypes, uses.two_types(),
         "an entry is of two types, by its ports or as a SubTree's constant (unsigned and int, say); BehaviorTree.CPP "
         "refuses that, or ends the tree");
  }
}

Expected<void> Differences::look_at_attribute(const std::string& name, const std::string& where) {
  if (!name.starts_with('_')) return {};
  const auto stray = stray_attribute(name);
  if (!stray) return {};
  const std::string shown = task::excerpt(name);
  const std::string hint = stray->meant.empty() ? "" : fmt::format("did you mean '{}'?", stray->meant);
  if (stray->is == Stray::Is::kMistake) return fail(fmt::format("there is no attribute '{}'", shown), where, hint);
  if (strays_.size() <= kMost && strays_.insert(shown).second)
    add(where, fmt::format("the attribute '{}' means nothing{}{}", shown, hint.empty() ? "" : "; ", hint));
  return {};
}

std::vector<std::string> Differences::take() {
  if (more_ > 0) lines_.push_back(fmt::format("and {} more", std::exchange(more_, 0)));
  return std::exchange(lines_, {});
}

}  // namespace pons::bridge::tree
