// What happens on the robot's side of the link in real time: the cerebellum on a thread of its own with real-time
// priority where it is granted, the body's physics and shutters on another. Neither waits for a bridge, nor needs one.
#pragma once

#include <atomic>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "pons/rt/clock.hpp"
#include "pons/rt/grant.hpp"
#include "pons/rt/triple_buffer.hpp"
#include "pons/runner/refusals.hpp"
#include "pons/runner/run.hpp"

namespace pons::runner {

// Neither the body nor the run's clock goes further than this past the last set-points. A real arm falls on while its
// loop is held up; a simulated one need not, and what a busy computer does to it would say nothing about a robot.
inline constexpr Duration kLeash = 4 * kControlPeriod;

// SCHED_FIFO's. The loop waits for nobody; the body, which on a robot would have a computer of its own, not for what
// thinks.
inline constexpr int kLoopPriority = rt::Scheduling{}.priority, kBodyPriority = 60, kBridgePriority = 10;
static_assert(kLoopPriority > kBodyPriority && kBodyPriority > kBridgePriority && kBridgePriority > 0);

class BodySide {
 public:
  // Begins; of one robot. `parts` and `clock`, which has kLeash, must outlive it; the body's thread paces the clock.
  BodySide(BodyParts& parts, rt::MonotonicClock& clock);
  // Both threads have ended when it returns, but for a loop that end() has left behind.
  ~BodySide();
  BodySide(const BodySide&) = delete;
  BodySide& operator=(const BodySide&) = delete;

  // Nothing more will come. Any thread.
  [[nodiscard]] bool finished() const { return finished_.load(); }
  // Error: body or camera failed, or nothing has come from the loop for a second; the loop has stopped. Any thread.
  [[nodiscard]] Expected<void> health() const;
  // What was refused to the two threads, and to whoever else notes it here.
  [[nodiscard]] Refusals& refusals() { return refusals_; }
  // Ends both threads. Once. Error: the loop does not end. Its thread is left behind, and this, its parts and its clock
  // must outlive it: leave them, too, and end the process.
  [[nodiscard]] Expected<LoopFigures> end();

 private:
  // Measurements and set-points change hands without either side waiting.
  struct Asked {
    Time at;
    body::SetPoints set_points;
  };

  void run_body();
  [[nodiscard]] LoopFigures run_loop();
  void fail(const Error& what);

  BodyParts& parts_;
  rt::MonotonicClock& clock_;
  rt::TripleBuffer<body::Sensors> measured_;
  rt::TripleBuffer<Asked> asked_;
  std::atomic<bool> running_{true}, finished_{false};
  Refusals refusals_;
  mutable std::mutex mutex_;
  std::optional<Error> error_;
  std::future<LoopFigures> figures_;  // the loop's, once it has ended
  std::jthread body_, loop_;
};

}  // namespace pons::runner
