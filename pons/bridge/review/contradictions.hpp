// What open tasks have been taken to do with which things: a task that says otherwise is refused, one brain's reply
// that says both, too.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/task/task.hpp"
#include "pons/world/review.hpp"

namespace pons::bridge {

// One use of a skill, and where the task has it: "/steps/1".
struct UseOf {
  task::Step use;
  std::string where;
};

class Contradictions {
 public:
  Contradictions() = default;
  explicit Contradictions(std::vector<world::Contradiction> kinds) : kinds_(std::move(kinds)) {}

  static constexpr std::size_t kMost = 1024;  // different claims of a task: a tree may go round for weeks

  // Claims what the uses do, O(log n) each. Of a tree, only some of them will come to pass: among themselves they may
  // say what they like. Errors: another task, or an earlier step, says otherwise; it claims too much. Then nothing of
  // this call is claimed.
  [[nodiscard]] Expected<void> claim(const task::Task& task, std::span<const UseOf> uses);
  // Of a task that has ended; nothing when it claims nothing.
  void release(std::string_view task);

 private:
  // Who says what of one thing.
  using Claims = std::map<std::string, std::set<std::string>>;
  // What a use is about, by one kind, and what it says of that.
  struct Said {
    const world::Contradiction* kind = nullptr;
    std::string about, says;
  };
  [[nodiscard]] std::vector<Said> said(const task::Step& use) const;
  struct Claim {
    std::string about, says;
    auto operator<=>(const Claim&) const = default;
  };
  struct Other {
    std::string task, says;
  };
  [[nodiscard]] std::optional<Other> against(const Said& said, const task::Task& task) const;
  void drop(const std::string& task, const Claim& claim);

  std::vector<world::Contradiction> kinds_;
  std::map<std::string, Claims> claims_;                            // by what they are about
  std::map<std::string, std::set<Claim>, std::less<>> claimed_by_;  // a task's, by its id
};

}  // namespace pons::bridge
