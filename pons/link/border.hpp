// All that a body's and a bridge's process share but pixels: the link, the camera frames' places, the run's clock, and
// what each must know of the other.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"
#include "pons/link/frames.hpp"
#include "pons/link/link.hpp"
#include "pons/rt/clock.hpp"
#include "pons/rt/shared_memory.hpp"
#include "pons/rt/wake_word.hpp"

namespace pons::link {

// What must be equal on both sides, beside what the memory itself compares: Border::kVersion and its size. Two builds
// that agree on those are taken for one.
struct Identity {
  std::array<char, 65> world{};  // its name
  std::uint64_t cell = 0;        // digest of the files that say what it is: world, scene, robot and tool
  std::uint64_t orders = 0;      // digest of what is to be sorted
  bool operator==(const Identity&) const = default;
};

// Errors: the body is of another world, of one of the same name from other files, or sorts other parcels.
[[nodiscard]] Expected<void> check_same(const Identity& body, const Identity& bridge, const std::string& name);

enum class Stage : std::uint32_t {
  kWaiting,  // the body waits for its first bridge; the run has not begun, and the clock means nothing
  kRunning,
  kEnding,  // the body is asked to end: the bridge shall leave the world safe and close the run
  kEnded,   // the body has left in order
};

enum class Closing : std::uint32_t { kOpen, kComplete, kBrokenOff };

// Made by the body, in shared memory (rt::Shared). No pointer is in it. Either side may be killed at any instant: what
// changes is one word, what one word tells, or a channel that bears it.
struct Border {
  // Grows with every change of what lies in here, messages included: of a field, its unit or an enumerator's value.
  static constexpr std::uint64_t kVersion = 5;
  static constexpr std::size_t kLongestPath = 4096;

  Border(const Identity& who, std::uint64_t life) : identity(who), body(life) {}

  const Identity identity;
  const std::uint64_t body;  // differs from every other body's that was or will be

  // The body's to change.
  rt::WakeWord stage;                 // a Stage
  rt::MonotonicClock clock;           // the run's; made anew just before kRunning
  std::atomic<bool> finished{false};  // nothing more will come

  Link link;
  Frames frames;

  // The bridge's to change.
  std::atomic<bool> ready{false};  // one has all its parts together: the run may begin
  std::atomic<Closing> closing{Closing::kOpen};
  std::atomic<std::int64_t> last_outcome_ns{0};  // of a task that the brain asked for
  std::atomic<std::int64_t> retries{0};          // of all bridges

  // The bridge's journal, by its absolute path. False: the path is too long. A bridge that comes after the end names
  // none.
  [[nodiscard]] bool name_journal(std::string_view path);
  // The body's, after the end, or a bridge's that comes: what was named last, by one that may be dead. Empty: by none.
  [[nodiscard]] std::string journal() const;

  [[nodiscard]] Stage now_at() const { return static_cast<Stage>(stage.value()); }
  void go_to(Stage next) { stage.set(static_cast<std::uint32_t>(next)); }

 private:
  // A path is written where the present one does not lie, and told when it is whole. Each ends with a zero.
  std::array<std::array<char, kLongestPath>, 2> paths_{};
  std::atomic<std::uint32_t> named_{0};  // how many were; the present one is paths_[named_ % 2]
};

// The memory of the frames' pixels, beside a border of that name.
inline constexpr std::uint64_t kFramesVersion = 1;
[[nodiscard]] inline std::string frames_name(std::string_view name) { return std::string(name) + ".frames"; }

}  // namespace pons::link
