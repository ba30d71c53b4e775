// Follows what a policy says, chunk after chunk, for a while.
#pragma once

#include <string>
#include <vector>

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// A policy that somebody else runs, who sends its chunks in.
inline constexpr std::string_view kOutside = "outside";

// `policies`: the names that can be asked for, beside kOutside. While one is followed, cell.stream is where its chunks
// go.
[[nodiscard]] task::SkillType follow_policy(Cell& cell, const std::vector<std::string>& policies);

}  // namespace pons::skills
