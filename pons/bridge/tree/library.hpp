// The trees that a world has, in the XML files of its folder, and what tasks ask for made ready to run.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "pons/bridge/tree/program.hpp"
#include "pons/core/error.hpp"
#include "pons/task/skill.hpp"
#include "pons/task/task.hpp"

namespace pons::bridge::tree {

// Of a tree that a task brings along: it is compiled in the tick in which it is asked for.
inline constexpr TreeSize kMaxSent{.nodes = 2'000, .bytes = 256UL * 1024};

class Library {
 public:
  // `skills` must outlive it and must not change.
  explicit Library(const task::SkillRegistry& skills) : skills_(&skills) {}

  // Every *.xml in it; a folder that does not exist holds none. Errors: of a document, of a tree that cannot run, one
  // name twice; then it holds what it held. Else this takes the place of what was loaded before.
  [[nodiscard]] Expected<void> load(const std::filesystem::path& folder);
  // In the order of their names.
  [[nodiscard]] std::vector<std::string> names() const;
  // nullptr: there is none of that name.
  [[nodiscard]] std::shared_ptr<const Program> find(std::string_view name) const;

  // The world's, or what is sent along. Errors: there is none of that name; of a document; of a tree that cannot run,
  // or is too large; an input that it does not know. They name the place in the task.
  [[nodiscard]] Expected<std::shared_ptr<const Program>> program(const task::TreeRequest& request) const;

 private:
  const task::SkillRegistry* skills_;
  std::map<std::string, std::shared_ptr<const Program>, std::less<>> programs_;
};

}  // namespace pons::bridge::tree
