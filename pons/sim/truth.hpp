// What really happened, for the referee and for tests. No other header of pons/sim includes this one, so nothing that
// perceives or decides can reach it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/pose.hpp"
#include "pons/core/pose2.hpp"
#include "pons/core/time.hpp"

namespace pons::sim {

class Simulation;
class BaseSimulation;

enum class LabelTruth : std::uint8_t { kReadable, kDown, kDamaged, kUnknownCode, kTwoCodes };
enum class Whereabouts : std::uint8_t { kNotOffered, kBelt, kHeld, kFalling, kChute, kException, kTray, kFloor };
[[nodiscard]] std::string_view name(LabelTruth label);
[[nodiscard]] std::string_view name(Whereabouts where);

// One parcel of the manifest, in its order.
struct ParcelTruth {
  std::string parcel_id;
  std::string destination;  // as ordered
  LabelTruth label = LabelTruth::kReadable;
  std::string shows;                 // the code on its label, its own but of kUnknownCode; of kTwoCodes, the other's
  bool touching = false;             // was put down touching, overlapping or leaning on a neighbour
  bool overweight = false;           // really heavier than rules.max_mass_kg
  bool oversize = false;             // really longer than rules.max_size_m, or too large for its chute
  Vector3 size_m = Vector3::Zero();  // length, width, height
  double mass_kg = 0;                // real
  Time offered;                      // when it was put on the belt; meaningless while kNotOffered
  Whereabouts where = Whereabouts::kNotOffered;
  std::string place;         // the place's name for kChute, kException and kTray, else name(where)
  Time arrived;              // when it came to rest there
  double max_press_n = 0;    // largest sum of the arm's and tool's net normal forces on it, over 10 ms
  double max_squeeze_n = 0;  // largest single contact with anything else while it was held
  double max_drop_m = 0;     // deepest fall: from where it began to sink unheld to where it stopped
  int picks = 0;             // times it was lifted off by the cups
  int drops = 0;             // times it was lost although the vacuum was on
  int arm = -1;              // whose cups last held it, in the order of world.arms(); -1: none has
};

// A joint beyond its limit, over steps that follow one another closely.
struct Breach {
  enum class Of : std::uint8_t { kSpeed, kTorque };
  Of of = Of::kSpeed;
  int axis = 0;
  Time from, to;
  double worst_ratio = 0;  // to the limit
};

// How hard the arm really worked, over every physics step so far. Ratios to world limits; above 1 is a violation.
struct ArmTruth {
  std::uint64_t steps = 0;
  double worst_speed_ratio = 0;
  double worst_acceleration_ratio = 0;        // speed difference of two steps, over the step
  double worst_mean_acceleration_ratio = 0;   // the same over 10 ms: contact chatter averaged out
  double worst_torque_ratio = 0;              // commanded, before the drives clamp it
  double worst_position_ratio = 0;            // outside [min, max]: 1 + excess in rad
  std::uint64_t speed_violations = 0;         // axis-steps above 1.001
  std::uint64_t acceleration_violations = 0;  // of the 10 ms mean
  std::uint64_t torque_violations = 0;
  std::vector<Breach> breaches;  // by their beginning; the first hundred
};

// A read-only window on a simulation; use it on the thread that advances it. The simulation must outlive it.
class Truth {
 public:
  explicit Truth(const Simulation& simulation);

  [[nodiscard]] const std::vector<ParcelTruth>& parcels() const;
  [[nodiscard]] const std::vector<ArmTruth>& arms() const;  // in the order of world.arms()
  // The least that any two arms, with what hung on them, were ever apart, looked at every fifth step; at most 1.
  [[nodiscard]] double least_between_arms_m() const;
  // World pose of the middle of the parcel's top face as the parcel was put down, x along its length; nothing while it
  // is not in the cell.
  [[nodiscard]] std::optional<Pose> top(std::size_t parcel) const;
  // Speed of that parcel's middle, world frame; zero when it is not in the cell.
  [[nodiscard]] Vector3 velocity_m_s(std::size_t parcel) const;
  // Which cups of the first arm are driven, bit i = cup i.
  [[nodiscard]] std::uint32_t cups_on() const;
  // What everything else exerts on all arms and tools through contacts at this moment: N, world frame.
  [[nodiscard]] Vector3 force_on_arm_n() const;
  // How many of the manifest lie on the belt, unheld.
  [[nodiscard]] int on_belt() const;

 private:
  const Simulation* simulation_;
};

// ---- a base ----

struct BasePlace {
  Time stamp;
  Pose2 map_from_base;
};

// Where a base was, in a memory that does not grow with the time that it goes on: every place of the last kWhole, and
// of what is longer ago where it stood. That is where goals are, and a run that ends with its tasks is shorter.
class BaseWay {
 public:
  static constexpr Duration kWhole = std::chrono::minutes(30);

  // The places in the order of their time.
  void add(const BasePlace& place);
  // Every one of the last kWhole, the newest last.
  [[nodiscard]] const std::deque<BasePlace>& lately() const { return lately_; }
  // Where it was then: exact within kWhole; before that where it stood last, within 1 mm and 1 mrad. Nothing: it was
  // nowhere yet.
  [[nodiscard]] std::optional<Pose2> at(Time time) const;
  [[nodiscard]] std::size_t size() const { return lately_.size() + stands_.size(); }

 private:
  std::deque<BasePlace> lately_;
  std::vector<BasePlace> stands_;  // where it came to stand, each once
};

// Where a base really was, and what it ran into, over every physics step so far.
struct BaseTruth {
  BaseWay way;             // every 10 ms
  double fastest_m_s = 0;  // of its frame, along the floor
  double driven_m = 0;
  int collisions = 0;   // times it came to touch anything but the floor
  std::string touched;  // what it touched last
};

// Valid while the simulation lives; use it on the thread that advances it.
[[nodiscard]] const BaseTruth& truth_of(const BaseSimulation& simulation);

}  // namespace pons::sim
