#include "pons/bridge/tree/markup.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "pons/task/spelling.hpp"

namespace pons::bridge::tree {
namespace {

constexpr std::array kConditionNames{
    ConditionName{"_failureIf", &Conditions::failure_if}, ConditionName{"_successIf", &Conditions::success_if},
    ConditionName{"_skipIf", &Conditions::skip_if},       ConditionName{"_while", &Conditions::while_true},
    ConditionName{"_onHalted", &Conditions::on_halted},   ConditionName{"_onFailure", &Conditions::on_failure},
    ConditionName{"_onSuccess", &Conditions::on_success}, ConditionName{"_post", &Conditions::post},
};
constexpr std::string_view kAutoremap = "_autoremap";
// Of no meaning to anybody who runs a tree: what a person has written on a node in Groot2, and what
// WriteTreeToXML() of BehaviorTree.CPP adds (its header writes _fullPath, its source _fullpath).
constexpr std::array<std::string_view, 4> kRemarks{"_description", "_uid", "_fullpath", "_fullPath"};

std::string lower(std::string_view text) {
  std::string result(text);
  std::ranges::transform(result, result.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; });
  return result;
}

// How many slips of a key there may be in a name.
std::size_t slips(std::string_view name) { return name.size() < 8 ? 1 : 2; }

}  // namespace

std::span<const ConditionName> condition_names() { return kConditionNames; }

std::optional<Stray> stray_attribute(std::string_view name) {
  constexpr std::size_t kShort = 5;  // "_post": "_port" and "_pose" are words as good
  std::array<std::string_view, kConditionNames.size() + 1> known;
  std::ranges::transform(kConditionNames, known.begin(), &ConditionName::name);
  known.back() = kAutoremap;
  const auto is = [name](std::string_view one) { return name == one; };
  if (std::ranges::any_of(known, is) || std::ranges::any_of(kRemarks, is)) return std::nullopt;
  for (const std::string_view one : known) {
    if (name.size() > one.size() + slips(one)) continue;
    const std::size_t distance = task::edits(lower(name), lower(one));
    if (distance > slips(one)) continue;
    const bool sure = distance == 0 || one.size() > kShort;
    return Stray{one, sure ? Stray::Is::kMistake : Stray::Is::kRemark};
  }
  return Stray{};
}

std::string_view entry_in(std::string_view text, std::string_view port) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == text.npos) return {};
  text = text.substr(first, text.find_last_not_of(' ') + 1 - first);
  if (text == "{=}" || text == "=") return port;
  if (text.size() < 3 || text.front() != '{' || text.back() != '}' || text[1] == '"') return {};
  return text.substr(1, text.size() - 2);
}

std::optional<Value> status_of(std::string_view text) {
  constexpr std::array kNames{std::pair{std::string_view("SUCCESS"), NodeStatus::kSuccess},
                              std::pair{std::string_view("FAILURE"), NodeStatus::kFailure},
                              std::pair{std::string_view("SKIPPED"), NodeStatus::kSkipped},
                              std::pair{std::string_view("RUNNING"), NodeStatus::kRunning}};
  const auto* found = std::ranges::find(kNames, text, [](const auto& pair) { return pair.first; });
  if (found == kNames.end()) return {};
  return std::int64_t{std::to_underlying(found->second)};
}

}  // namespace pons::bridge::tree
