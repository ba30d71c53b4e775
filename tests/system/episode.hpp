// One cell, from its first parcel to its last, with everything going wrong on the way; then calm, in which all must
// come to its end. One seed, one episode, to the last event.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/core/digest.hpp"
#include "pons/core/random.hpp"
#include "pons/link/link.hpp"
#include "pons/world/world.hpp"
#include "tests/crash/disk.hpp"
#include "tests/system/network.hpp"
#include "tests/system/plant.hpp"
#include "tests/system/process.hpp"
#include "tests/system/referee.hpp"
#include "tests/system/senders.hpp"
#include "tests/system/steps.hpp"

namespace pons::tests {

// What happened, for whoever replays a seed: the last lines, and a digest of all of them.
class Trace {
 public:
  enum class Told : std::uint8_t { kAtTheEnd, kAtOnce };
  explicit Trace(Told told) : told_(told) {}
  void add(Time now, const std::string& line);
  [[nodiscard]] std::uint64_t digest() const { return digest_.value(); }
  [[nodiscard]] const std::deque<std::string>& last() const { return last_; }

 private:
  static constexpr std::size_t kLast = 200;
  Told told_;
  Digest digest_;
  std::deque<std::string> last_;
};

struct EpisodeOptions {
  std::uint64_t seed = 1;
  Duration faults_for = std::chrono::minutes(10);  // then calm
  Disk::Syncs syncs = Disk::Syncs::kTruly;
  Trace::Told told = Trace::Told::kAtTheEnd;
  std::optional<Plan> before{};  // what befalls one before that
  std::optional<Plan> only{};    // the only thing that befalls a bridge process, the first that comes by there
};

struct EpisodeResult {
  std::vector<std::string> wrong;
  std::deque<std::string> last;
  std::uint64_t digest = 0;
  Time lasted;
  std::size_t wishes = 0, accepted = 0, processes = 0, stops = 0;
  NetworkLosses network;
  Disk::Losses disk;
  std::map<task::Outcome, std::size_t> outcomes;
  std::map<Step, std::int64_t> ends, passed;
};

// What the episodes of one program share: loaded once. Error: a file of the world.
struct Cellar {
  [[nodiscard]] static Expected<Cellar> load();
  world::World world;
  model::RobotModel model;
};

[[nodiscard]] EpisodeResult run_episode(const Cellar& cellar, const EpisodeOptions& options);

}  // namespace pons::tests
