// The contract every robot satisfies, simulated or real. The cerebellum talks to this and to nothing lower.
#pragma once

#include <array>
#include <cstdint>

#include "pons/core/axes.hpp"
#include "pons/core/error.hpp"
#include "pons/core/image.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"

namespace pons::body {

// What the robot measures. Fixed size. A measurement must be sensible, and follow from the one before: plausible.hpp.
struct Sensors {
  Time stamp;
  AxisVector position;                      // rad
  AxisVector speed;                         // rad/s
  std::array<double, 3> wrist_force_n{};    // at the flange, flange frame: what the tool and load exert on the arm
  std::array<double, 3> wrist_torque_nm{};  // likewise
  std::array<double, kMaxCups> cup_vacuum_kpa{};  // below ambient; 0 = open, about 60 = sealed
  double belt_travel_m = 0;                       // encoder: how far the belt has run since the start
  double belt_speed_m_s = 0;                      // encoder
  bool photo_eye_blocked = false;                 // at the belt's entry
  bool stop_input = false;                        // the body's own stop button or safety chain
  bool watchdog_tripped = false;                  // the body's watchdog has taken the power off: see Body
  // How often, since the start, something fell through the light curtain below the mouth of each of the world's places:
  // so far below that what lies on the rim has not.
  std::array<std::uint16_t, kMaxPlaces> fallen_into{};
  std::uint32_t zones_occupied = 0;  // bit i: somebody is in the world's zone i (scanner, light curtain)
};

// What the robot is told. Fixed size.
struct SetPoints {
  AxisVector torque_nm;         // one an axis
  std::uint32_t vacuum_on = 0;  // bit i = cup i
  bool power = false;           // false: drives off, brakes on, whatever the torque says
  bool belt_runs = false;       // false: the belt is brought to rest, for nobody is there to take from it
};

// A robot. One thread calls read and write, in turn, once a tick.
//
// Its watchdog. A body with power that hears no write() for watchdog() of its own time takes the power off by itself:
// drives off, brakes on, belt to rest, cups as they were told last. That is latched: the body says so in Sensors, and
// takes set-points with power for ones without until it has heard some without; the next ones with power ask for it
// anew. Without power silence means nothing. conformance.hpp checks a body against all this.
class Body {
 public:
  virtual ~Body() = default;
  // The newest measurement. Never blocks.
  virtual void read(Sensors& sensors) PONS_NONBLOCKING = 0;
  // In force until the next write. Never blocks.
  virtual void write(const SetPoints& set_points) PONS_NONBLOCKING = 0;
  // How long it goes on without hearing set-points.
  [[nodiscard]] virtual Duration watchdog() const = 0;
};

// A camera: begin() opens the shutter, finish() waits for the picture. begin is called by whoever advances the body;
// finish may be called by another thread. At most one frame is under way. Its pixels are written where the frame's
// arrays lie, when these have the camera's size.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const Intrinsics& intrinsics() const = 0;
  virtual void begin(Time now) = 0;
  [[nodiscard]] virtual Expected<void> finish(RgbdFrame& frame) = 0;
};

}  // namespace pons::body
