// What a tree does here that it does not in BehaviorTree.CPP, and what of it does nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/tree/document.hpp"
#include "pons/bridge/tree/entry_uses.hpp"
#include "pons/bridge/tree/program.hpp"
#include "pons/core/error.hpp"

namespace pons::bridge::tree {

class Differences {
 public:
  static constexpr std::size_t kMost = 32;  // lines; a tree that somebody sends may be full of them

  // So many of the nodes above one may halt it, make something else of its failure, or run it beside others.
  struct Above {
    int halting = 0, catching = 0, beside = 0;
    void count(Kind kind, const Element& element, int by);
  };
  // Of each sort of difference the first is told.
  void look(const Element& element, Kind kind, const Above& above);
  // The key of an UnsetBlackboard: whether it is in braces, and whether it may name an entry of another blackboard.
  void look_at_key(const Element& element, bool in_braces, bool leads_out);
  // When all of the tree has been looked at.
  void look(const EntryUses& uses);
  // An attribute that is no port's. What means nothing is told once for each name. Error: one that begins with an
  // underscore and is so near to a name that means something that it must be a slip.
  [[nodiscard]] Expected<void> look_at_attribute(const std::string& name, const std::string& where);
  void add(std::string_view where, std::string_view what);

  // A line each, and how many more there are.
  [[nodiscard]] std::vector<std::string> take();

 private:
  enum class Sort : std::uint8_t {
    kSkill,
    kTime,
    kPrecondition,
    kReactive,
    kException,
    kBeside,
    kKeyRead,
    kKeyElsewhere,
    kType,
    kTwoTypes
  };
  void tell(Sort sort, std::string_view where, std::string_view what);

  std::set<Sort> told_;
  std::set<std::string> strays_;  // attributes that were told of
  std::vector<std::string> lines_;
  std::size_t more_ = 0;
};

}  // namespace pons::bridge::tree
