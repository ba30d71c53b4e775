// Runs a policy beside the skill that follows it: asks it in time, and hands on what it says.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "pons/brain/inference.hpp"
#include "pons/task/policy.hpp"

namespace pons::brain {

// How long a policy of a stream takes, from the observation to its chunk. What it really takes comes on top when that
// is longer, in real time.
struct Latency {
  Duration usual{0};
  Duration first{0};  // of the first inference, which loads, compiles and warms up
};

// From a task's arguments.
using PolicyMaker = std::function<std::shared_ptr<task::Policy>(const task::Json& arguments)>;
using PolicyMakers = std::map<std::string, PolicyMaker, std::less<>>;

// The bridge's thread. A stream is asked for at its `rate_hz` (10 without), several inferences under way if they take
// longer than that; earlier when its motion would run out before an answer of the usual latency came. The first
// inference is waited for, and its latency counts for none of the others.
class PolicyRunner {
 public:
  // `inference` must outlive it.
  PolicyRunner(PolicyMakers makers, Inference& inference) : makers_(std::move(makers)), inference_(inference) {}

  // Once a bridge tick: the stream that goes on, or null. One whose policy is not among the makers is somebody else's.
  void attend(task::ChunkStream* stream, Time now);

  // Inferences asked for, of the present stream.
  [[nodiscard]] std::int64_t asked() const { return asked_; }

 private:
  struct Asked {
    std::uint64_t stream;
    Time at, due;
  };
  void begin(const task::ChunkStream& stream);
  [[nodiscard]] bool is_time(const task::Observation& seen, Time now) const;
  void hand_on(task::ChunkStream* stream, Time now);

  PolicyMakers makers_;
  Inference& inference_;
  std::uint64_t stream_ = 0;  // present one's number
  std::shared_ptr<task::Policy> policy_;
  Latency modelled_;
  Duration every_{0};
  std::deque<Asked> under_way_;  // of earlier streams, too
  std::int64_t asked_ = 0, answered_ = 0;
  std::optional<Time> asked_at_;
  Duration usual_{0};  // latency, as measured
};

}  // namespace pons::brain
