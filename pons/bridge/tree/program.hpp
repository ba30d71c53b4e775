// A behaviour tree made ready to run: nodes in one row, depth first, every name of the blackboard resolved to a slot.
// Immutable; any number of tasks may run the same one.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/bridge/tree/document.hpp"
#include "pons/bridge/tree/script.hpp"
#include "pons/bridge/tree/value.hpp"
#include "pons/core/error.hpp"
#include "pons/task/schema.hpp"
#include "pons/task/skill.hpp"

namespace pons::bridge::tree {

inline constexpr std::size_t kMaxSlots = 10'000;

// How large a tree may be, SubTrees in full.
struct TreeSize {
  std::size_t nodes = 20'000;
  std::size_t bytes = 2 * kMaxXmlBytes;  // of its attributes, its elements' ids and its models' ports
};

enum class NodeStatus : std::uint8_t {
  kIdle,
  kRunning,
  kSuccess,
  kFailure,
  kSkipped,
  kBroken,  // ends the whole tree, whatever is above: an exception, a script that went wrong, a task that is cancelled
};

[[nodiscard]] constexpr bool has_ended(NodeStatus status) {
  return status == NodeStatus::kSuccess || status == NodeStatus::kFailure;
}

enum class Kind : std::uint8_t {
  // control
  kSequence,
  kAsyncSequence,
  kSequenceWithMemory,
  kReactiveSequence,
  kFallback,
  kAsyncFallback,
  kReactiveFallback,
  kParallel,
  kParallelAll,
  kIfThenElse,
  kWhileDoElse,
  kSwitch,
  kTryCatch,
  // decorators
  kInverter,
  kForceSuccess,
  kForceFailure,
  kRepeat,
  kRetry,
  kKeepRunning,
  kTimeout,
  kDelay,
  kRunOnce,
  kPrecondition,
  kLoop,
  kSkipUnlessUpdated,
  kWaitValueUpdate,
  kSubTree,
  // leaves
  kAlwaysSuccess,
  kAlwaysFailure,
  kScript,
  kScriptCondition,
  kSetBlackboard,
  kUnsetBlackboard,
  kSleep,
  kWasEntryUpdated,
  kSkill,
};

[[nodiscard]] constexpr bool is_decorator(Kind kind) { return kind >= Kind::kInverter && kind <= Kind::kSubTree; }
// Its children, while they run.
[[nodiscard]] constexpr bool may_halt(Kind kind) {
  return kind == Kind::kReactiveSequence || kind == Kind::kReactiveFallback || kind == Kind::kParallel ||
         kind == Kind::kParallelAll || kind == Kind::kWhileDoElse || kind == Kind::kSwitch || kind == Kind::kTimeout;
}

// What a node was given: a constant, or what a slot holds when it is read.
struct Port {
  std::int32_t slot = -1;
  Value literal = {};
};

struct Node {
  Kind kind = Kind::kAlwaysSuccess;
  std::int32_t end = 0;          // one past its last descendant
  std::int32_t children = 0;     // the first is the next node, each other begins where the one before ends
  std::int32_t ports = 0;        // its first; they come in the order that node_kinds.cpp names them in
  std::int32_t conditions = -1;  // which, if any
  std::int32_t index = -1;       // of its script, its loop, its skill
};

// By script, -1 where there is none; in the order of their evaluation.
struct Conditions {
  std::int32_t failure_if = -1, success_if = -1, skip_if = -1, while_true = -1;
  std::int32_t on_halted = -1, on_failure = -1, on_success = -1, post = -1;
};

// What a Loop takes its values from, where that is a constant; and what it holds them to be.
struct Loop {
  enum class Of : std::uint8_t { kInteger, kBoolean, kReal, kText };
  Of of = Of::kText;
  std::optional<std::vector<Value>> fixed;
};

// A leaf that uses a skill.
struct SkillUse {
  struct Argument {
    std::string name;
    Json schema;
    std::int32_t slot = 0;
  };
  struct Output {
    std::string name;  // in the detail that the skill ends with
    std::int32_t slot = 0;
  };
  const task::SkillType* type = nullptr;
  std::string name;                    // of the node
  Json arguments = Json::object();     // the constant ones
  std::vector<Argument> bound;         // the others
  std::vector<Output> outputs;         // written when it succeeds
  std::optional<task::Schema> schema;  // of all arguments; where some are bound
  std::uint64_t resources = 0;         // a bit for each that the program knows
};

struct Entry {
  std::string name;     // "mass_kg"; of a subtree's own "weigh/mass_kg"
  Value initial = {};   // a constant that a SubTree was given
  bool exists = false;  // from the start
};

struct Program {
  std::vector<Node> nodes;
  std::vector<std::string> names;  // by node, for people: "weigh/Sequence"
  std::vector<Port> ports;
  std::vector<Conditions> conditions;
  std::vector<Script> scripts;
  std::vector<Loop> loops;
  std::vector<SkillUse> uses;                             // in the order of the nodes
  std::vector<Entry> entries;                             // the blackboard's, by slot
  std::map<std::string, std::int32_t, std::less<>> root;  // slots of the main tree by name: what it may be given
  std::vector<std::string> needs;      // of those, what a node reads and none sets: whoever asks for the tree gives it
  std::vector<std::string> resources;  // that its skills need
  std::vector<std::string> differences;  // from what BehaviorTree.CPP does with it, a line each
  std::uint64_t fingerprint = 0;         // of the document; what was written down of one program fits no other
};

// `main` names the tree; empty: the document's. `skills` must outlive the program. Errors name the line: no such tree,
// a cycle of SubTrees, too large, a tag that is neither a node nor a skill, children that a node cannot have, ports
// that do not exist or are missing, values and scripts that cannot be read, what BehaviorTree.CPP has and Pons has not.
[[nodiscard]] Expected<std::shared_ptr<const Program>> compile(const Document& document, std::string_view main,
                                                               const task::SkillRegistry& skills,
                                                               const TreeSize& most = {});
// A Sequence of them. Every step's skill must be in `skills`, its arguments must fit.
[[nodiscard]] std::shared_ptr<const Program> program_of(const std::vector<task::Step>& steps,
                                                        const task::SkillRegistry& skills);

// The values of a Loop in a text, apart by ';'. Nothing: one is not of that type.
[[nodiscard]] std::optional<std::vector<Value>> queue_of(std::string_view text, Loop::Of of);
// What text means as a boolean, as there.
[[nodiscard]] std::optional<Value> boolean_of(std::string_view text);
// What text means as a value that `schema` describes: "2.5" as a number, "true" as a boolean, "1;2;3" or "[1,2,3]" as a
// list. Error: it cannot be read so.
[[nodiscard]] Expected<Json> argument_of(const Value& value, const Json& schema);

}  // namespace pons::bridge::tree
