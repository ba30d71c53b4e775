// The control step and the safety machine: follows the motion that the link brings, keeps every limit in every tick,
// and stops by itself. It never waits for anyone, knows no task and no brain, and needs nobody alive to stop safely.
//
// When it stops, how hard, and what leads out of a stop again: safety_machine.hpp, docs/safety.md. Cups keep what they
// were told through every stop: a held parcel stays held.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "pons/body/body.hpp"
#include "pons/cerebellum/collision.hpp"
#include "pons/cerebellum/control_laws.hpp"
#include "pons/cerebellum/delay_line.hpp"
#include "pons/cerebellum/limit_watch.hpp"
#include "pons/cerebellum/motion_queue.hpp"
#include "pons/cerebellum/motion_time.hpp"
#include "pons/cerebellum/safety_machine.hpp"
#include "pons/cerebellum/vacuum.hpp"
#include "pons/cerebellum/wrist.hpp"
#include "pons/core/error.hpp"
#include "pons/core/realtime.hpp"
#include "pons/core/time.hpp"
#include "pons/link/link.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/motion/axis_profile.hpp"
#include "pons/rt/event_log.hpp"

namespace pons::cerebellum {

[[nodiscard]] constexpr std::array<double, kMaxZones> all_of_it() {
  std::array<double, kMaxZones> shares{};
  shares.fill(1);
  return shares;
}

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
  // After the commanded stop ended: what swings on the cups, or is dragged from under them, moves the arm for a second.
  Duration confirm_within = std::chrono::milliseconds(2000);
  Duration stall_timeout = std::chrono::milliseconds(20);  // between two steps, while powered
  RateBounds rate;                                         // of a motion that is slowed for a zone
  Duration slow_within = std::chrono::milliseconds(500);   // from somebody's coming to the speed that is allowed
  double recovery_share = 0.1;                             // of each speed limit, in recovery
  // What is allowed of each axis' speed limit while somebody is in zone i: 1 all, 0 a protective stop.
  std::array<double, kMaxZones> zone_speed_share = all_of_it();
  double max_payload_kg = 20;  // a kPayload above is a bad command
};

// Whether a cerebellum can work so. Errors: a setting that is not finite or out of range; limits that are not finite,
// not positive or contradict each other; a home outside them; drives too weak to hold the arm at home, or that delay
// set-points for more than kMaxDelayTicks.
[[nodiscard]] Expected<void> check(const model::RobotModel& model, const Settings& settings);

class Cerebellum {
 public:
  // `start` is the time of the step before the first. The model's robot gives the limits. Both as check() wants them.
  // Begins disarmed. What its first measurement finds on the cups, the cups go on holding: one before it had taken it.
  Cerebellum(model::RobotModel model, const Settings& settings, Time start);
  Cerebellum(const Cerebellum&) = delete;
  Cerebellum& operator=(const Cerebellum&) = delete;

  // One tick at `now`, which grows from call to call: takes in the measurement and all commands, moves the commanded
  // state on, and says what the drives shall do until the next. What is commanded, checked and sent is the motion of
  // `now` and the robot's drive delay, for it acts by then; a measurement is held against what acts now. Measurements
  // that are not sensible, from the future, not newer than the last, or that do not follow from the last good one while
  // there is power (body/plausible.hpp), count as none. One thread.
  //
  // Which commands do what, and what refuses them (refused = counted in State::dropped; all need the present epoch
  // unless stated; another kind is refused):
  //   kHeartbeat       any epoch, any state
  //   kMotion          operational or in recovery, else refused. In the motion's time, which is State::late behind the
  //                    clock's. Not finite, from the past (it begins before the last step), a gap or a jump to what is
  //                    queued (SeamTolerance), a full queue, or queued motion that ends moving: protective stop
  //                    kBadCommand. Beyond a limit when its tick comes: protective stop kLimit, from the last tick.
  //   kVacuum          operational only; a cup that the tool does not have: protective stop kBadCommand
  //   kPayload         any state, and forgotten when the cups have lost or let go of what they held; negative, not
  //                    finite or above max_payload_kg: protective stop kBadCommand
  //   kContact         operational or in recovery, and forgotten when either begins; negative, not finite or above
  //                    CollisionSettings::contact_max_n: protective stop kBadCommand
  //   kControl         operational and commanded to rest, else refused; a fault() of its parameters: protective stop
  //                    kBadCommand. The commanded position becomes the one that the arm is held at. Until kArm or a
  //                    stop.
  //   kBelt            operational only, and forgotten when armed
  //   kProtectiveStop  any epoch, any state
  //   kReset           from a stop or recovery, at measured standstill, word and stop input released, and
  //                    nobody in a zone that stops
  //   kArm             disarmed, at measured standstill, inside the position limits, word and stop input released; the
  //                    commanded position becomes the measured one
  //   kRecover         likewise, wherever the arm is. Until kReset every axis keeps recovery_share of its speed limit,
  //                    and one outside its position limits goes no further outside than it is
  void step(Time now, const body::Sensors& sensors, link::CerebellumEnd& link,
            body::SetPoints& set_points) PONS_NONBLOCKING;

  // As of the last step. The stepping thread's.
  [[nodiscard]] const link::State& state() const { return state_; }
  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  // Stops and why, standstill, resets, arming, refused commands. One other thread may drain it.
  [[nodiscard]] rt::EventLog& log() { return log_; }

 private:
  void watch_loop(Time now);
  void take_measurement(Time now, const body::Sensors& sensors);
  [[nodiscard]] bool leaps(const body::Sensors& sensors) const;
  void hold_what_hangs(const body::Sensors& sensors);
  void feel(const body::Sensors& sensors, WristSense::Bias bias);
  void watch(Time now, const link::CerebellumEnd& link);
  void watch_following(Time now);
  void watch_zones(Time now);
  [[nodiscard]] std::optional<double> too_fast(const AxisState& next, Time now) const;
  void watch_contact(Time now);
  void watch_springs(Time now);
  void watch_cups(Time now);
  void take_commands(Time now, link::CerebellumEnd& link);
  [[nodiscard]] bool take(const link::Command& command, Time now);
  [[nodiscard]] bool take_motion(const link::Command& command, Time now);
  [[nodiscard]] bool take_vacuum(const link::Command& command, Time now);
  [[nodiscard]] bool take_payload(const link::Command& command, Time now);
  void bear(const model::Payload& payload);
  [[nodiscard]] bool take_contact(const link::Command& command, Time now);
  [[nodiscard]] bool take_control(const link::Command& command, Time now);
  [[nodiscard]] bool reset(Time now);
  [[nodiscard]] bool arm(Time now);
  [[nodiscard]] bool recover(Time now);
  [[nodiscard]] bool begin(SafetyEvent event, Time now);
  void widen();
  void narrow();
  // False where the machine has no such transition.
  bool enter(SafetyEvent event);
  // False if it is stopped so or harder already.
  bool stop(link::StopCause cause, Time now);
  void advance(Time now);
  void follow(Time now);
  bool leave_commanded(link::StopCause cause);
  void widen_to_stop(AxisLimits& limits) const;
  double plan_stop();
  [[nodiscard]] double stop_duration_s() const;
  [[nodiscard]] double drive_use_of_stop();
  void stop_at(double t_s, AxisState& state) const;
  void go_on_from(const AxisState& state);
  void hold_measured(Time now);
  void judge_stop(Time now);
  void control(Time now, body::SetPoints& set_points);
  void publish_measurement(const body::Sensors& sensors);
  void publish(link::CerebellumEnd& link, const body::SetPoints& set_points);

  [[nodiscard]] bool is_silent(Time now) const;
  [[nodiscard]] bool is_standing(Time now) const;
  [[nodiscard]] bool is_released() const { return !word_raised_ && !stop_input_ && !zone_stops_; }
  [[nodiscard]] const AxisLimits& limits() const { return limits_; }
  [[nodiscard]] const AxisLimits& robot_limits() const;

  const Settings settings_;
  const std::size_t delay_ticks_;
  const Duration delay_;  // of the drives
  model::RobotModel model_;
  model::Payload payload_;  // as told, until it was seen to be lost
  AxisLimits limits_;       // in force: the robot's, and where the arm is outside them
  LimitWatch limit_watch_;
  CollisionWatch collision_;
  ControlLaws laws_;
  WristSense wrist_;
  const VacuumSettings vacuum_settings_;
  VacuumState vacuum_;
  MotionQueue queue_;
  MotionTime motion_time_;
  link::State state_;
  Statistics statistics_;
  rt::EventLog log_;
  link::Command command_;  // scratch

  // The commanded state as of the last step, at stepped_, for delay_ later; before_ is the one a step earlier.
  AxisState commanded_, before_;
  Time stepped_;
  Duration stall_{0};  // so long no step was made before this one, where that is too long
  double dt_s_ = 0;

  // Measurement: the newest good one, and what it says of this tick (carried on by its speed).
  bool seen_ = false;
  Time measured_stamp_, heard_stamp_, fresh_at_;  // heard: believed or not
  AxisVector measured_position_, measured_speed_, position_now_, speed_now_;
  bool is_still_ = false, is_too_fast_ = false;
  Time still_since_;
  std::uint32_t zones_ = 0;  // occupied
  std::optional<Time> slow_since_;
  bool strays_ = false, hasty_ = false;
  Time strays_since_, hasty_since_;

  // After a collision the arm gives way while it brakes, one that was held off brakes along a path from where it was;
  // either then holds where that brought it.
  bool gives_way_ = false, held_off_ = false;
  AxisVector driven_nm_;  // what the drives were told last
  struct Driven {
    AxisVector torque_nm;
    bool powered = false;
  };
  DelayLine<Driven> driven_;  // until it acts
  SafetyMachine machine_;
  bool powered_ = false;  // the machine's
  bool word_raised_ = false, stop_input_ = false, watchdog_tripped_ = false, zone_stops_ = false;
  std::uint32_t vacuum_on_ = 0;
  Time heard_at_;  // last command of any kind
  Time stop_began_, stop_ends_;
  std::array<motion::AxisProfile, kMaxAxes> stop_profiles_;
};

}  // namespace pons::cerebellum
