// For the tests of trees: from XML to a tree that runs, with skills that do what they are told.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "pons/bridge/test_kit.hpp"
#include "pons/bridge/tree/tree.hpp"

namespace pons::bridge::tree {

// What stands in <BehaviorTree> of a document of one tree.
inline std::string in_document(const std::string& nodes) {
  return fmt::format(R"(<root BTCPP_format="4"><BehaviorTree ID="Main">{}</BehaviorTree></root>)", nodes);
}

class TreeTest : public testing::Test {
 protected:
  static constexpr int kForEver = 1'000'000;

  // Its ID in the trees is its name.
  void add(Actor& actor, int attempts = 1, Duration timeout = from_s(10)) {
    skills_.add(actor.type(attempts, timeout));
  }

  std::unique_ptr<Tree> tree_of(const std::string& nodes) { return tree_of_text(in_document(nodes)); }
  std::unique_ptr<Tree> tree_of_text(const std::string& text, const std::string& main = "") {
    const auto document = read_document(text, "test");
    EXPECT_TRUE(document) << document.error().line();
    if (!document) return nullptr;
    const auto program = compile(*document, main, skills_);
    EXPECT_TRUE(program) << program.error().line();
    return program ? std::make_unique<Tree>(*program, observer_) : nullptr;
  }
  // The line that refuses it.
  std::string refusal(const std::string& text, const std::string& main = "") {
    const auto document = read_document(text, "test");
    if (!document) return document.error().line();
    const auto program = compile(*document, main, skills_);
    return program ? "taken" : program.error().line();
  }
  // Ticks every 10 ms until it does not run.
  Status run(Tree& tree, int most_ticks = 10'000) {
    for (int i = 0; i < most_ticks; ++i) {
      const Status status = tick(tree);
      if (status != Status::kRunning) return status;
    }
    return Status::kRunning;
  }
  Status tick(Tree& tree) {
    const Status status = tree.tick(now_);
    now_ += from_s(0.01);
    return status;
  }

  Time now_;
  std::vector<std::string> seen_;  // "pick1s" starts, "pick1n" notes, "pick1e" ends
  Observer observer_ = [this](const Attempt& attempt, Time) -> Expected<void> {
    const char* const what = attempt.ended != nullptr ? "e" : (attempt.note != nullptr ? "n" : "s");
    seen_.push_back(fmt::format("{}{}{}", attempt.skill, attempt.number, what));
    return {};
  };
  task::SkillRegistry skills_;
};

}  // namespace pons::bridge::tree
