// What turns frames into beliefs, as those see it who hand frames over and pass beliefs on. One thread.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "pons/core/axes.hpp"
#include "pons/core/belief.hpp"
#include "pons/core/image.hpp"
#include "pons/core/time.hpp"

namespace pons::perception {

// What the robot and belt measured when the frame's shutter was open.
struct Moment {
  ArmPositions joint_position;
  double belt_travel_m = 0;
};

// Each says what it can tell of; the rest is as if nothing were there. See perception.hpp, localiser.hpp.
class Sight {
 public:
  virtual ~Sight() = default;
  // Takes in one frame, in the order of their stamps.
  virtual void process(const RgbdFrame& frame, const Moment& moment) = 0;

  [[nodiscard]] virtual std::vector<ObjectBelief> beliefs(Time, double /*belt_travel_m*/) const { return {}; }
  [[nodiscard]] virtual std::vector<ObjectBelief> cut(Time, double /*belt_travel_m*/) const { return {}; }
  [[nodiscard]] virtual bool sees_belt() const { return true; }
  [[nodiscard]] virtual bool wants_labels() const { return false; }
  virtual void forget(std::uint32_t /*track*/) {}
  [[nodiscard]] virtual int occupancy(std::string_view /*place*/) const { return 0; }
  [[nodiscard]] virtual std::optional<BaseBelief> base() const { return std::nullopt; }
};

}  // namespace pons::perception
