// The cell as it really is, at the level of events: an arm that is exactly where the loop has commanded it, cups that
// take hold of a parcel or miss it, a belt that carries, a printer that does what it is told at once. It knows nothing
// of tasks. What is here is the truth that the referee holds the journal against.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pons/body/body.hpp"
#include "pons/core/belief.hpp"
#include "pons/core/random.hpp"
#include "pons/link/message.hpp"
#include "pons/model/robot_model.hpp"
#include "pons/world/world.hpp"

namespace pons::tests {

struct Parcel {
  enum class Where : std::uint8_t { kBelt, kCups, kPlace };
  std::string code;
  std::string destination;  // as ordered
  std::uint32_t track = 0;  // a new one each time that it comes to lie somewhere
  Where where = Where::kBelt;
  std::string place;  // kPlace: a chute, the exception chute, or the tray
  double x_m = 0, y_m = 0;
  int taken = 0, left = 0;  // how often cups took hold of it, and let go or lost it
  bool was_lost = false;    // the last time
};

// A share of the times, or of the time.
struct PlantFaults {
  double missed = 0.05;             // the cups do not seal
  double lost_per_s = 0.01;         // what they hold, they lose,
  double lost_astray_per_s = 0.01;  // or over a chute that is not its own
};

class Plant {
 public:
  using Say = std::function<void(const std::string&)>;
  // `world` must outlive it.
  Plant(const world::World& world, model::RobotModel model, Random random, Say say);

  // One period: what the cups, the belt and gravity do while the arm is where the loop commanded it.
  void step(Time now, const link::State& loop, const body::SetPoints& told);
  [[nodiscard]] const body::Sensors& sensors() const { return sensors_; }

  // At the upstream end of the belt, or farther upstream where that is taken.
  void put_on_belt(const std::string& code, const std::string& destination);
  // What a camera that sees everything on the belt would have perception believe.
  [[nodiscard]] std::vector<ObjectBelief> beliefs(Time now) const;
  // One of them: the middle of its top; nothing when it is not on the belt.
  [[nodiscard]] std::optional<Vector3> top_of(const std::string& code) const;
  [[nodiscard]] const std::map<std::string, Parcel>& parcels() const { return parcels_; }
  [[nodiscard]] const world::World& world() const { return world_; }
  [[nodiscard]] const Parcel* on_cups() const;
  [[nodiscard]] bool moves() const { return moves_; }  // in this period

  // One job, by the task that asked and its number; done as soon as it is told.
  void print(const std::string& task, int number) { ++printed_[{task, number}]; }
  [[nodiscard]] int printed(const std::string& task, int number) const;
  [[nodiscard]] const std::map<std::pair<std::string, int>, int>& prints() const { return printed_; }

  PlantFaults faults;
  std::function<void()> when_left;  // something has left the cups

 private:
  void ride();
  void hold(Time now);
  void take(Time now);
  void leave(Parcel& parcel, std::string_view how);
  [[nodiscard]] double beside_others(double x_m) const;
  [[nodiscard]] Vector3 tip();
  [[nodiscard]] bool is_astray(const Parcel& parcel, const Vector3& tip) const;

  const world::World& world_;
  model::RobotModel model_;
  Random random_;
  Say say_;
  body::Sensors sensors_;
  std::map<std::string, Parcel> parcels_;
  std::vector<Parcel*> on_belt_;  // of those
  std::string held_;              // a code
  std::map<std::pair<std::string, int>, int> printed_;
  std::uint32_t told_cups_ = 0;
  bool misses_ = false;  // since the cups were switched on
  bool moves_ = false;
  std::uint32_t tracks_ = 0;
};

inline constexpr double kParcelHeight_m = 0.12, kParcelLength_m = 0.20, kParcelWidth_m = 0.15, kParcelMass_kg = 1.0;

}  // namespace pons::tests
