// servo: the joints go after the set-points that somebody sends, one after the other.
#pragma once

#include "pons/skills/cell.hpp"
#include "pons/task/skill.hpp"

namespace pons::skills {

// So long after the last set-point it ends. They come once a second, and one may be lost.
inline constexpr Duration kServoSilence = std::chrono::milliseconds(3500);

// Arguments {"positions": rad}, one an axis: the first set-point. While it runs, cell.servo is where others go
// (Servo::take()). Each is gone to from whatever the arm is doing, smoothly and within its limits, in half as long
// again as the last set-points were apart, so that the next finds it moving; who sends no other has it come to rest
// there. Ends kSucceeded, with {"why", "set_points", "refused"}, when none has come for kServoSilence, or when a task
// waits for the arm (cell.is_waited_for). What comes in the way stops it; the next set-point moves it on. Cups empty.
[[nodiscard]] task::SkillType servo(Cell& cell);

// Whether the arm could rest there. Errors: another number of values than it has axes; outside its position limits, or
// no number; in touch with what stands there for good.
[[nodiscard]] Expected<void> check_set_point(Cell& cell, const AxisVector& position);

}  // namespace pons::skills
