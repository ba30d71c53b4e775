// What nodes and scripts do with the entries of the blackboards: which of them something sets, where the others are
// read, and of what type BehaviorTree.CPP takes each to be. Here an entry holds whatever is written to it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pons/bridge/tree/node_kinds.hpp"
#include "pons/bridge/tree/program.hpp"
#include "pons/bridge/tree/script.hpp"

namespace pons::bridge::tree {

// To be told in the order of the document: there, the first port that names an entry gives it its type.
class EntryUses {
 public:
  void read(std::int32_t slot, const std::string& where);
  void set(std::int32_t slot) { of(slot).set = true; }
  // What runs `script` there, which reads `text`, does both.
  void by(const Script& script, std::string_view text, const std::string& where);
  // A port of a node, of which a Loop has values of that type, an argument of a skill, what a skill tells; each given
  // {entry}.
  void port(std::int32_t slot, const PortType& type, Loop::Of loop, const std::string& where);
  void argument(std::int32_t slot, const Json& schema, const std::string& where);
  void output(std::int32_t slot);
  // Of a node that looks whether it was updated.
  void watch(std::int32_t slot) { give(slot, Type::kWatched); }
  // What a SubTree is given, before any port in it.
  void constant(std::int32_t slot, const Value& value);
  // A SetBlackboard writes `value`, a constant or what another entry holds.
  void set_to(std::int32_t slot, const Port& value, const std::string& where);

  // Those that are read and never set, by slot, and where they are read first.
  [[nodiscard]] std::vector<std::pair<std::int32_t, std::string>> unset() const;
  // Where a SetBlackboard, a Loop or, a text, a script first writes what does not become there what it becomes here;
  // nullptr: nowhere.
  [[nodiscard]] const std::string* retyped() const;
  // Where a port first takes an entry to be of another type than one before it; empty: nowhere.
  [[nodiscard]] const std::string& two_types() const { return two_types_; }

 private:
  enum class Type : std::uint8_t {
    kNone,  // that of the first value
    kText,  // or another that is no number
    kInteger,
    kUnsigned,
    kBoolean,
    kReal,
    kNumber,  // one of those, nobody knows which
    kOpen,    // any, but a text that a SetBlackboard writes is lost
    kWatched  // any, but no text
  };
  [[nodiscard]] static bool is_number(Type type) { return type >= Type::kInteger && type <= Type::kNumber; }
  [[nodiscard]] static Type type_of(const PortType& type, Loop::Of loop);
  struct Use {
    bool known = false;  // in `read_`
    bool set = false;
    bool in_script = false;
    bool by_script = false;  // written
    bool made = false;       // by a script's ":="
    bool copied = false;     // what another entry held was written to it
    bool texts = false;      // may have been written to it
    Type given = Type::kNone;
    [[nodiscard]] Type type() const { return given == Type::kNone && made ? Type::kOpen : given; }
    [[nodiscard]] bool may_be_text() const { return texts || !set; }
  };
  enum class By : std::uint8_t { kSetBlackboard, kScript, kLoop };
  struct Writing {
    std::int32_t slot;
    By by;
    std::string where;
    Port value = {};  // of a SetBlackboard
  };
  [[nodiscard]] static bool copy_differs(const Use& to, const Use& from);
  [[nodiscard]] static bool text_differs(const Use& to, const std::string& text);
  Use& of(std::int32_t slot) { return uses_[slot]; }
  void give(std::int32_t slot, Type type);

  std::map<std::int32_t, Use> uses_;
  std::vector<std::pair<std::int32_t, std::string>> read_;  // each slot once, in the order of the first readings
  std::vector<Writing> writings_;                           // by scripts those of texts alone
  std::string two_types_;
};

}  // namespace pons::bridge::tree
