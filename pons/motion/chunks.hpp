// Late, overlapping chunks of actions to one smooth motion. Knows no clock and no link: it is handed times and gives
// back the segments to be queued.
//
// The motion is a uniform cubic B-spline (de Boor 1978): control points kKnot apart, of which each piece of motion
// needs four. So it is continuous in acceleration whatever the control points are, and their first, second and third
// differences bound speed, acceleration and jerk. A new chunk changes control points, from the first one on that no
// motion before the splice needs; there is no seam to be solved. How many actions have been executed is one more
// coordinate of the same spline, so the number belongs to the motion, however late it comes or slowly it goes.
#pragma once

#include <cstdint>
#include <vector>

#include "pons/core/chunk.hpp"
#include "pons/core/error.hpp"
#include "pons/motion/motion.hpp"

namespace pons::motion {

inline constexpr Duration kKnot = std::chrono::milliseconds(20);
inline constexpr double kSameProgress = 1e-6;  // actions: as many have been executed
inline constexpr Duration kShortestPeriod = std::chrono::milliseconds(20);
inline constexpr Duration kLongestPeriod = std::chrono::milliseconds(200);
inline constexpr Duration kLongestChunk = std::chrono::seconds(4);  // at the policy's pace

// Whether a chunk makes sense by itself. Errors, by `where`: chunk_empty; chunk_period; chunk_long; chunk_size, an
// action has another number of axes; chunk_not_finite; chunk_position, an action lies outside the position limits;
// chunk_observed, a count that is negative or not finite.
[[nodiscard]] Expected<void> check_chunk(const Chunk& chunk, const AxisLimits& limits);

// Of one stream. Times are the motion's. One thread.
class ChunkPath {
 public:
  // The arm rests at `position`, from `at` on, and `executed` actions have been executed.
  ChunkPath(const AxisVector& position, Time at, double executed);

  // Takes a chunk in: what replaces the queued motion from front().start on, which is `from` or up to a knot later.
  // It ends at rest at the chunk's last action, so a stream that dries up stops by itself, and every control point lies
  // between old motion and new actions. Where the limits ask for it the motion is slower than the policy's pace.
  // Errors, by `where`: those of check_chunk(); chunk_past, all its actions will have been executed by then;
  // chunk_future, it was observed after `now`; chunk_limits, no way was found from the present motion to it. The motion
  // is then as it was.
  [[nodiscard]] Expected<Trajectory> splice(const Chunk& chunk, Time now, Time from, const AxisLimits& limits);

  // To rest along the present path: what replaces the queued motion. Error, chunk_limits: none was found that keeps
  // them; the motion, which ends at rest by itself, is as it was.
  [[nodiscard]] Expected<Trajectory> stop(Time from, const AxisLimits& limits);

  // How many actions have been executed at `time`.
  [[nodiscard]] double executed(Time time) const;
  // Whether the motion is slower there than the policy's pace for want of actions: it brakes for the end of what has
  // come, rests there, or takes up speed again. Not before the first chunk, nor at the end of the last one.
  [[nodiscard]] bool starved(Time time) const;
  // From when on it is starved if nothing more comes, or end().
  [[nodiscard]] Time enough_until() const;
  // When it comes to rest.
  [[nodiscard]] Time end() const;
  // Up to which number of actions it leads.
  [[nodiscard]] double queued() const { return knots_.back().progress; }

 private:
  enum class Want : std::uint8_t { kNone, kActions };
  struct Knot {
    AxisVector position;  // control point
    double progress = 0;  // likewise, actions
    Want want = Want::kNone;
  };
  class Course;
  struct Candidate {
    double pace;  // share of the policy's
    int brake;    // knots
    int blend;    // knots, from the old motion to the new one
    int ramp;     // knots, to take the pace up
  };
  [[nodiscard]] const Knot& at(std::int64_t index) const;
  [[nodiscard]] std::int64_t knot_at(Time time) const;
  [[nodiscard]] Knot between(double index) const;
  [[nodiscard]] double progress_between(double index) const;
  void draw(const Chunk& chunk, const Candidate& candidate);
  [[nodiscard]] bool draw_within(const Chunk& chunk, const AxisLimits& limits);
  [[nodiscard]] Trajectory take_over(std::int64_t free);
  [[nodiscard]] Segment segment(std::int64_t index) const;

  Time origin_;                      // of knot 0
  std::int64_t first_ = 0;           // index of knots_.front()
  std::vector<Knot> knots_;          // before the first and after the last it rests
  std::int64_t free_ = 0;            // of a splice: the first control point that may change
  std::vector<Knot> plain_, drawn_;  // of a splice: the new motion by itself, and blended into the old one
};

}  // namespace pons::motion
