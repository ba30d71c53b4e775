// detect: waits until a labelled object is believed to be there, and says where.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// Arguments {"object": code, "within_s": seconds (default 5)}. Detail of success: position_m, yaw_rad, size_m,
// confidence. Ends kFailed when it is not seen in time. Moves nothing.
[[nodiscard]] task::SkillType detect(Cell& cell);

}  // namespace pons::skills
