// Between a policy, which looks and says what to do next, and the skill that makes motion of it.
#pragma once

#include <cstdint>
#include <vector>

#include "pons/core/belief.hpp"
#include "pons/core/chunk.hpp"
#include "pons/core/error.hpp"
#include "pons/task/task.hpp"

namespace pons::task {

// What a policy decides on.
struct Observation {
  Time stamp;                         // of the arm's measurement, and what the beliefs are predicted to
  AxisVector position, speed;         // measured, rad and rad/s
  double executed = 0;                // actions of the stream by then: what the chunk made of it says as `observed`
  Duration enough{0};                 // for so long the arm still moves at the policy's pace on what has come
  std::vector<ObjectBelief> objects;  // and after them what is only an obstacle
};

// A learned policy, or what stands for one. Its calls come one at a time, but maybe on a thread of its own.
class Policy {
 public:
  virtual ~Policy() = default;
  [[nodiscard]] virtual Chunk infer(const Observation& observation) = 0;
};

// A stream that goes on, as those see it who feed it. The bridge's thread.
class ChunkStream {
 public:
  virtual ~ChunkStream() = default;
  [[nodiscard]] virtual std::uint64_t number() const = 0;         // no other stream of this bridge has it
  [[nodiscard]] virtual const Json& arguments() const = 0;        // as the task has them
  [[nodiscard]] virtual Observation observe(Time now) const = 0;  // as of the last bridge tick
  // Splices a chunk into the motion. Errors, by `where`: those of motion::ChunkPath::splice(); chunk_stopped, the arm
  // is stopped, comes to rest or has not begun; chunk_stale, it was observed before the arm was stopped;
  // chunk_not_clear, its way is not clear. The motion is then as it was.
  [[nodiscard]] virtual Expected<void> take(const Chunk& chunk, Time now) = 0;
};

}  // namespace pons::task
