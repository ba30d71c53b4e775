// The bridge's hand on the arm: streams motion and vacuum through the link and remembers what it asked for, so that the
// next motion can start in the middle of the last one without a seam. One thread, the bridge's.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/link/link.hpp"
#include "pons/motion/motion.hpp"
#include "pons/world/world.hpp"

namespace pons::skills {

// A motion that was sent to the loop, in the loop's ticks of a millisecond since the run's begin.
struct SentMotion {
  std::int64_t first_tick = 0, last_tick = 0;
};

// From the moment a motion is planned to its begin: two bridge periods, one for the command to arrive, one in reserve.
inline constexpr Duration kSpliceLead = std::chrono::milliseconds(20);

// Times are the clock's. The motion's own time is State::late behind it: whoever planned on it hears of a motion that
// has become later by late(), and the motion asked for moves along.
class Arm {
 public:
  // Both must outlive it. A motion that arrives after its begin is refused and stops the arm, so where ticks may come
  // late `splice_lead` must be longer than they do. The robot's drive delay is added: so far ahead the loop commands.
  Arm(link::BridgeEnd& link, const world::World& world, Duration splice_lead = kSpliceLead);

  // Once a bridge tick, before any skill: takes in the newest state and shows the cerebellum that the bridge lives. A
  // loop of which nothing new has come for unheard() counts as disarmed: the body's watchdog has taken the power off.
  void refresh(Time now);

  // Without a new state for so long the loop is taken for dead: see refresh().
  [[nodiscard]] Duration unheard() const { return unheard_; }
  [[nodiscard]] const link::State& state() const { return state_; }
  [[nodiscard]] bool operational() const { return state_.safety == link::SafetyState::kOperational; }
  // Stopped by what it met: a blow, or something that held it off its way.
  [[nodiscard]] bool has_struck() const {
    return state_.cause == link::StopCause::kCollision || state_.cause == link::StopCause::kFollowingError;
  }

  // How late the motion is by now; what was planned to happen with it happens so much later than it was planned then.
  [[nodiscard]] Duration late() const { return state_.late; }
  // What zones allow of the speed limits now.
  [[nodiscard]] double speed_share() const { return state_.speed_share; }

  // Where the motion asked for so far will be at `time`.
  [[nodiscard]] AxisState planned(Time time) const;
  [[nodiscard]] Time motion_end() const;
  // The earliest moment from which a motion may be replaced: the link and the loop need some ticks.
  [[nodiscard]] Time splice_time(Time now) const { return now + splice_lead_; }
  // The earliest one at which the motion under way already keeps `limits`: a heavy load must not inherit the haste of
  // what came before.
  [[nodiscard]] Time splice_time(Time now, const AxisLimits& limits) const;

  // Replaces what was asked for from trajectory.front().start on. Error: the link is full.
  [[nodiscard]] Expected<void> stream(const motion::Trajectory& trajectory);
  // What was sent since the last call.
  [[nodiscard]] std::vector<SentMotion> take_sent() { return std::exchange(sent_, {}); }
  // Shown each command from now on once it is sent, heartbeats left out, and the time of the tick that it is sent in.
  using ShowSent = std::function<void(Time, const link::Command&)>;
  void show_sent(ShowSent show) { show_sent_ = std::move(show); }
  // From the splice time to standstill along the limits.
  [[nodiscard]] Expected<void> stop(Time now);

  void vacuum(bool on);
  void payload(double mass_kg, const Vector3& com_in_flange_m);
  // From now on the tip may meet this force (N) without its being taken for a collision; until told otherwise, also
  // when the arm is armed again.
  void expect_contact(double force_n);
  // By which law the arm follows from now on; it must rest. Parameters: see cerebellum's fault().
  void control(link::Controller controller, const link::Compliance& compliance = {});
  // Once a bridge tick while it matters.
  void belt(link::Belt wanted);
  [[nodiscard]] const link::Vacuum& cups() const { return state_.vacuum; }

  // A protective stop, whatever moves it.
  void halt() { (void)send({.kind = link::CommandKind::kProtectiveStop}); }
  // Leaves a stop (when it may) and arms from standstill. Moves nothing.
  void arm(Time now);
  // Likewise, for recovery; and in recovery, slowly in, until every axis stands inside its position limits. One step.
  // Error: no way in.
  [[nodiscard]] Expected<void> recover(Time now);
  // By how much an axis stands outside its position limits; 0 inside.
  [[nodiscard]] double outside_rad() const;

 private:
  bool send(link::Command command);
  void listen(Time now);
  void tell_payload();

  link::BridgeEnd& link_;
  const world::World& world_;
  Duration splice_lead_, unheard_;
  link::State state_;
  motion::Trajectory asked_;  // in the motion's time
  std::vector<SentMotion> sent_;
  ShowSent show_sent_;
  Time now_;        // of the last refresh
  AxisState rest_;  // in force when nothing was asked for since arming
  std::uint64_t sequence_ = 0;
  double contact_n_ = 0, payload_kg_ = 0;
  Vector3 payload_com_m_ = Vector3::Zero();  // flange frame
  std::uint64_t heard_tick_ = 0;             // of the loop,
  Time heard_;                               // and when
  link::Controller controlled_before_ = link::Controller::kTracking;
  link::SafetyState safety_before_ = link::SafetyState::kDisarmed;
};

// By how much the motion has become later since the last look: so far whatever was planned with it moves along.
class Delay {
 public:
  explicit Delay(const Arm& arm) : arm_(arm), late_(arm.late()) {}
  [[nodiscard]] Duration take() { return arm_.late() - std::exchange(late_, arm_.late()); }

 private:
  const Arm& arm_;
  Duration late_;
};

}  // namespace pons::skills
