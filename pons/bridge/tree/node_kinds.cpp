#include "pons/bridge/tree/node_kinds.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace pons::bridge::tree {
namespace {

using Of = PortType::Of;
constexpr auto kMay = PortType::Need::kMay;
constexpr auto kMany = std::numeric_limits<std::int32_t>::max();

constexpr std::array kParallelPorts{PortType{"success_count", Of::kInteger, "-1"},
                                    PortType{"failure_count", Of::kInteger, "1"}};
constexpr std::array kParallelAllPorts{PortType{"max_failures", Of::kInteger, "1"}};
constexpr std::array kSwitchPorts{PortType{"variable", Of::kText, "", kMay}, PortType{"case_1", Of::kText, "", kMay},
                                  PortType{"case_2", Of::kText, "", kMay},   PortType{"case_3", Of::kText, "", kMay},
                                  PortType{"case_4", Of::kText, "", kMay},   PortType{"case_5", Of::kText, "", kMay},
                                  PortType{"case_6", Of::kText, "", kMay}};
constexpr std::array kTryCatchPorts{PortType{"catch_on_halt", Of::kBoolean, "false"}};
constexpr std::array kRepeatPorts{PortType{"num_cycles", Of::kInteger}};
constexpr std::array kRetryPorts{PortType{"num_attempts", Of::kInteger}};
constexpr std::array kTimePorts{PortType{"msec", Of::kUnsigned}};
constexpr std::array kDelayPorts{PortType{"delay_msec", Of::kUnsigned}};
constexpr std::array kRunOncePorts{PortType{"then_skip", Of::kBoolean, "true"}};
constexpr std::array kPreconditionPorts{PortType{"if", Of::kScript}, PortType{"else", Of::kStatus, "FAILURE"}};
constexpr std::array kLoopPorts{PortType{"queue", Of::kQueue}, PortType{"if_empty", Of::kStatus, "SUCCESS"},
                                PortType{"value", Of::kOut, "", kMay}};
constexpr std::array kEntryPorts{PortType{"entry", Of::kKey}};
constexpr std::array kScriptPorts{PortType{"code", Of::kScript}};
constexpr std::array kSetPorts{PortType{"value", Of::kValue}, PortType{"output_key", Of::kKey}};
constexpr std::array kUnsetPorts{PortType{"key", Of::kKey}};

constexpr KindInfo switch_of(std::string_view name, std::int32_t cases) {
  return {name, Kind::kSwitch, cases + 1, cases + 1,
          std::span(kSwitchPorts).first(static_cast<std::size_t>(cases) + 1)};
}

constexpr std::array kKinds{
    KindInfo{"Sequence", Kind::kSequence, 1, kMany},
    KindInfo{"AsyncSequence", Kind::kAsyncSequence, 1, kMany},
    KindInfo{"SequenceWithMemory", Kind::kSequenceWithMemory, 1, kMany},
    KindInfo{"ReactiveSequence", Kind::kReactiveSequence, 1, kMany},
    KindInfo{"Fallback", Kind::kFallback, 1, kMany},
    KindInfo{"AsyncFallback", Kind::kAsyncFallback, 1, kMany},
    KindInfo{"ReactiveFallback", Kind::kReactiveFallback, 1, kMany},
    KindInfo{"Parallel", Kind::kParallel, 1, kMany, kParallelPorts},
    KindInfo{"ParallelAll", Kind::kParallelAll, 1, kMany, kParallelAllPorts},
    KindInfo{"IfThenElse", Kind::kIfThenElse, 2, 3},
    KindInfo{"WhileDoElse", Kind::kWhileDoElse, 2, 3},
    switch_of("Switch2", 2),
    switch_of("Switch3", 3),
    switch_of("Switch4", 4),
    switch_of("Switch5", 5),
    switch_of("Switch6", 6),
    KindInfo{"TryCatch", Kind::kTryCatch, 2, kMany, kTryCatchPorts},
    KindInfo{"Inverter", Kind::kInverter, 1, 1},
    KindInfo{"ForceSuccess", Kind::kForceSuccess, 1, 1},
    KindInfo{"ForceFailure", Kind::kForceFailure, 1, 1},
    KindInfo{"Repeat", Kind::kRepeat, 1, 1, kRepeatPorts},
    KindInfo{"RetryUntilSuccessful", Kind::kRetry, 1, 1, kRetryPorts},
    KindInfo{"KeepRunningUntilFailure", Kind::kKeepRunning, 1, 1},
    KindInfo{"Timeout", Kind::kTimeout, 1, 1, kTimePorts},
    KindInfo{"Delay", Kind::kDelay, 1, 1, kDelayPorts},
    KindInfo{"RunOnce", Kind::kRunOnce, 1, 1, kRunOncePorts},
    KindInfo{"Precondition", Kind::kPrecondition, 1, 1, kPreconditionPorts},
    KindInfo{"LoopInt", Kind::kLoop, 1, 1, kLoopPorts, Loop::Of::kInteger},
    KindInfo{"LoopBool", Kind::kLoop, 1, 1, kLoopPorts, Loop::Of::kBoolean},
    KindInfo{"LoopDouble", Kind::kLoop, 1, 1, kLoopPorts, Loop::Of::kReal},
    KindInfo{"LoopString", Kind::kLoop, 1, 1, kLoopPorts, Loop::Of::kText},
    KindInfo{"SkipUnlessUpdated", Kind::kSkipUnlessUpdated, 1, 1, kEntryPorts},
    KindInfo{"WaitValueUpdate", Kind::kWaitValueUpdate, 1, 1, kEntryPorts},
    KindInfo{"SubTree", Kind::kSubTree, 0, 0},
    KindInfo{"AlwaysSuccess", Kind::kAlwaysSuccess},
    KindInfo{"AlwaysFailure", Kind::kAlwaysFailure},
    KindInfo{"Script", Kind::kScript, 0, 0, kScriptPorts},
    KindInfo{"ScriptCondition", Kind::kScriptCondition, 0, 0, kScriptPorts},
    KindInfo{"SetBlackboard", Kind::kSetBlackboard, 0, 0, kSetPorts},
    KindInfo{"UnsetBlackboard", Kind::kUnsetBlackboard, 0, 0, kUnsetPorts},
    KindInfo{"Sleep", Kind::kSleep, 0, 0, kTimePorts},
    KindInfo{"WasEntryUpdated", Kind::kWasEntryUpdated, 0, 0, kEntryPorts},
};

using Why = std::pair<std::string_view, std::string_view>;
constexpr std::array kNotHere{
    Why{"ManualSelector", "a robot's tree asks nobody at a terminal; send another task instead"},
    Why{"SequenceStar", "it is called SequenceWithMemory now"},
    Why{"SubTreePlus", "it is called SubTree now; convert_v3_to_v4.py brings older trees over"},
    Why{"RetryUntilSuccesful", "it is written RetryUntilSuccessful now"},
    Why{"BlackboardCheckInt", "use Precondition or ScriptCondition"},
    Why{"BlackboardCheckDouble", "use Precondition or ScriptCondition"},
    Why{"BlackboardCheckString", "use Precondition or ScriptCondition"},
    Why{"BlackboardCheckBool", "use Precondition or ScriptCondition"},
    Why{"ConsumeQueue", "use LoopString or another of the Loops"},
};

}  // namespace

const KindInfo* find_kind(std::string_view name) {
  const auto found = std::ranges::find(kKinds, name, &KindInfo::name);
  return found == kKinds.end() ? nullptr : &*found;
}

std::span<const KindInfo> all_kinds() { return kKinds; }

std::string_view why_not(std::string_view name) {
  const auto found = std::ranges::find(kNotHere, name, &Why::first);
  return found == kNotHere.end() ? "" : found->second;
}

}  // namespace pons::bridge::tree
