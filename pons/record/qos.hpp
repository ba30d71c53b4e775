// How a ROS 2 publisher offers its messages, as recordings keep it: rosbag2 publishes them again like that.
#pragma once

#include <cstddef>
#include <string>

namespace pons::record {

// The numbers are those of rmw's enumerations.
enum class Reliability { kReliable = 1, kBestEffort = 2 };
enum class Durability { kTransientLocal = 1, kVolatile = 2 };

struct OfferedQos {
  Reliability reliability = Reliability::kReliable;
  Durability durability = Durability::kVolatile;
  std::size_t depth = 10;  // of keep last
};

// The text of a channel's metadata `offered_qos_profiles`. In numbers, as rosbag2 wrote it until Iron and still reads
// it: of the words that it writes since Jazzy, Humble knows none.
[[nodiscard]] std::string offered_qos_profiles(const OfferedQos& qos);

}  // namespace pons::record
