// What the parts of `pons doctor` share.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "pons/core/time.hpp"
#include "pons/rt/jitter.hpp"

namespace pons::apps {

enum class Finding : std::uint8_t { kGood, kDegraded, kBad };

// One line of the diagnosis; gives `finding` back.
Finding say(Finding finding, std::string_view what, std::string_view how);

// Who sets the clock rate of the CPU that a loop of the calling thread's would run on. `sys`: where the kernel's files
// lie.
struct Governor {
  int cpu = 0;
  std::string name;  // empty: nobody; the rate is not this system's to choose
};
[[nodiscard]] Governor loop_governor(const std::filesystem::path& sys = "/sys");

// Settings that a long run shows, but no trial of a moment does. `root`: where the kernel's files lie. The worst
// finding.
Finding read_settings(const std::filesystem::path& root = "/");

// Whether a loop that ran so would have held 1 kHz: no tick missed, none begun later than 100 µs.
Finding judge_jitter(const rt::Jitter& jitter);

// What the control loop needs of this machine: tries each thing, reads the settings that trials do not show, and runs
// an empty 1 kHz loop for that long (0: not). The worst of its findings.
Finding try_realtime(Duration jitter);

}  // namespace pons::apps
