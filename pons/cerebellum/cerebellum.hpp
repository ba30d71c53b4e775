// The control step and the safety machine: follows the motion that the link brings, keeps every limit in every tick,
// and stops by itself. It never waits for anyone, knows no task and no brain, and needs nobody alive to stop safely.
//
// States (IEC 60204-1 stop categories in brackets):
//   disarmed         after start (drives off, brakes on) and after kReset (drives as the stop left them: holding after
//   a
//                    protective stop, off after an emergency stop); takes no motion
//   operational      after kArm: follows motion, holds still when there is none
//   stopping         decelerates along jerk limits from the last commanded state, then waits for standstill
//   protective stop  [2] at rest, powered, holding; nothing but kReset leaves it
//   emergency stop   [1] at rest, drives off once standstill is measured, or [0] when it is not within confirm_within
// A protective stop that an emergency stop overtakes becomes one. Every emergency stop raises the epoch by one. Cups
// keep what they were told through every stop: a held parcel stays held.
#pragma once

#include <array>
#include <cstdint>

#include "pons/body/body.hpp"
#include "pons/cerebellum/collision.hpp"
#include "pons/cerebellum/control_laws.hpp"
#include "pons/cerebellum/limit_watch.hpp"
#include "pons/cerebellum/motion_queue.hpp"
#include "pons/cerebellum/tracker.hpp"
#include "pons/cerebellum/vacuum.hpp"
#include "pons/cerebellum/wrist.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"
#include "pons/link/link.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/axis_profile.hpp"
#include "pons/rt/event_log.hpp"

namespace pons::cerebellum {

struct Settings {
  Gains gains;
  CollisionSettings collision;
  ControlSettings control;
  Duration period = std::chrono::milliseconds(1);               // nominal, between two steps
  Duration heartbeat_timeout = std::chrono::milliseconds(100);  // without any command, while operational
  Duration silence_timeout = std::chrono::milliseconds(20);     // without a newer measurement, while powered
  double following_error_rad = 0.05;                            // of any axis,
  double yielding_error_rad = 0.5;                              // the same, of an arm that gives way as a spring does
  Duration following_time = std::chrono::milliseconds(20);      // for so long
  double standstill_rad_s = 0.02;                               // every axis below it,
  Duration standstill_time = std::chrono::milliseconds(20);     // for so long: standstill
  Duration confirm_within = std::chrono::milliseconds(500);     // after the commanded stop ended
  double max_payload_kg = 20;                                   // a kPayload above is a bad command
};

class Cerebellum {
 public:
  // `start` is the time of the step before the first. The model's robot gives the limits.
  Cerebellum(model::RobotModel model, const Settings& settings, Time start);
  Cerebellum(const Cerebellum&) = delete;
  Cerebellum& operator=(const Cerebellum&) = delete;

  // One tick at `now`, which grows from call to call: takes in the measurement and all commands, moves the commanded
  // state to `now`, and says what the drives shall do until the next. Measurements that are not finite, of another
  // length or not newer than the last count as none. One thread.
  //
  // Which commands do what, and what refuses them (refused = counted in State::dropped; all need the present epoch
  // unless stated):
  //   kHeartbeat       any epoch, any state
  //   kMotion          operational only, else refused. Not finite, from the past (it begins before the last step), a
  //   gap or a
  //                    jump to what is queued (SeamTolerance), a full queue, or queued motion that ends moving:
  //                    protective stop kBadCommand. Beyond a limit when its tick comes: protective stop kLimit, from
  //                    the last tick.
  //   kVacuum          operational only
  //   kPayload         any state; negative, not finite or above max_payload_kg: protective stop kBadCommand
  //   kContact         operational only, and forgotten when armed; negative, not finite or above
  //                    CollisionSettings::contact_max_n: protective stop kBadCommand
  //   kControl         operational and commanded to rest, else refused; a fault() of its parameters: protective stop
  //                    kBadCommand. The commanded position becomes the one that the arm is held at. Until kArm.
  //   kProtectiveStop  any epoch, any state
  //   kReset           from a protective or emergency stop, at measured standstill, word and stop input released
  //   kArm             disarmed, at measured standstill, word and stop input released; the commanded position becomes
  //   the
  //                    measured one
  void step(Time now, const body::Sensors& sensors, link::CerebellumEnd& link,
            body::SetPoints& set_points) PONS_NONBLOCKING;

  // As of the last step. The stepping thread's.
  [[nodiscard]] const link::State& state() const { return state_; }
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  // Stops and why, standstill, resets, arming, refused commands. One other thread may drain it.
  [[nodiscard]] rt::EventLog& log() { return log_; }

 private:
  enum class StopKind : std::uint8_t { kProtective, kEmergency };

  void take_measurement(Time now, const body::Sensors& sensors);
  void watch(Time now, const link::CerebellumEnd& link);
  void watch_following(Time now);
  void watch_contact(Time now);
  void watch_cups(Time now, const body::Sensors& sensors);
  void take_commands(Time now, link::CerebellumEnd& link);
  [[nodiscard]] bool take(const link::Command& command, Time now);
  [[nodiscard]] bool take_motion(const link::Command& command, Time now);
  [[nodiscard]] bool take_payload(const link::Command& command, Time now);
  [[nodiscard]] bool take_contact(const link::Command& command, Time now);
  [[nodiscard]] bool take_control(const link::Command& command, Time now);
  [[nodiscard]] bool reset(Time now);
  [[nodiscard]] bool arm(Time now);
  // False if it is stopped or stopping already.
  bool stop(StopKind kind, link::StopCause cause, Time now);
  void advance(Time now);
  void follow(Time now);
  void hold_measured(Time now);
  void sample_stop(Time now);
  void judge_stop(Time now);
  void control(Time now, body::SetPoints& set_points);
  void publish(link::CerebellumEnd& link, const body::Sensors& sensors, const body::SetPoints& set_points);

  [[nodiscard]] bool is_silent(Time now) const;
  [[nodiscard]] bool is_standing(Time now) const;
  [[nodiscard]] bool is_released() const { return !word_raised_ && !stop_input_; }
  [[nodiscard]] const AxisLimits& limits() const;

  const Settings settings_;
  Tracker tracker_;
  LimitWatch limit_watch_;
  CollisionWatch collision_;
  ControlLaws laws_;
  WristSense wrist_;
  const VacuumSettings vacuum_settings_;
  VacuumState vacuum_;
  MotionQueue queue_;
  link::State state_;
  Statistics statistics_;
  rt::EventLog log_;
  link::Command command_;  // scratch

  // The commanded state at stepped_, the last step's time; before_ is the one a step earlier.
  AxisState commanded_, before_;
  Time stepped_;
  double dt_s_ = 0;

  // Measurement: the newest good one, and what it says of this tick (carried on by its speed).
  bool seen_ = false;
  Time measured_stamp_, fresh_at_;
  AxisVector measured_position_, measured_speed_, position_now_, speed_now_;
  bool is_still_ = false, is_too_fast_ = false;
  Time still_since_;
  bool strays_ = false;
  Time strays_since_;

  // After a collision the arm gives way while it brakes, and then holds where that brought it.
  bool gives_way_ = false;
  AxisVector driven_nm_;  // what the drives were told last
  bool powered_ = false, emergency_ = false, word_raised_ = false, stop_input_ = false;
  std::uint32_t vacuum_on_ = 0;
  Time heard_at_;  // last command of any kind
  Time stop_began_, stop_ends_;
  std::array<motion::AxisProfile, kMaxAxes> stop_profiles_;
};

}  // namespace pons::cerebellum
