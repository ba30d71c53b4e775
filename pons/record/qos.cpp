#include "pons/record/qos.hpp"

#include <fmt/format.h>

namespace pons::record {

std::string offered_qos_profiles(const OfferedQos& qos) {
  constexpr const char* kNever = "\n    sec: 9223372036\n    nsec: 854775807";  // rmw's infinite duration
  return fmt::format(
      "- history: 1\n  depth: {}\n  reliability: {}\n  durability: {}\n  deadline:{}\n  lifespan:{}\n  liveliness: 1\n"
      "  liveliness_lease_duration:{}\n  avoid_ros_namespace_conventions: false",
      qos.depth, static_cast<int>(qos.reliability), static_cast<int>(qos.durability), kNever, kNever, kNever);
}

}  // namespace pons::record
