// What goes wrong on purpose in a simulated run: shares of picks, parcels and tasks, events an hour. Data like the
// world, in worlds/faults/ and worlds/NAME/faults/; docs/worlds.md has the keys.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/world/world.hpp"

namespace pons::world {

enum class Fault : std::uint8_t {
  kMissedGrasp,  // a pick: the cups do not seal in that attempt
  kWeakVacuum,   // a pick: they seal, but leak
  kDoublePick,   // a pick: what is lifted drags a neighbour along until it is let go of
  kDrop,         // a pick: the seal is lost on the way
  kDoubleLabel,  // a parcel: it shows a second label, its own code or another parcel's
  kBeltJam,      // an hour: the belt stands although it is told to run
  kOcclusion,    // an hour: something hangs between the belt's cameras and a part of what they watch
  kBlackout,     // an hour: the belt's cameras deliver black frames without depth
  kShiftedView,  // an hour: the belt's cameras stand elsewhere than they are believed to, by by_m
  kBrainStall,   // an hour: the brain is silent
  kVacuumWeak,   // an hour: the pump gives only a share of its vacuum, to all cups
  kBridgeCrash,  // an hour: the bridge is killed; lasts until the next one is there
  kBrainLie,     // an hour, a moment each: the brain asks for something wrong beside its work
  kNetworkLoss,  // an hour: between brain and bridge messages are lost, late, and come twice
  kLoopCrash,    // an hour: the control loops are killed; lasts until new ones are there
};
inline constexpr std::size_t kFaults = 15;
// As the file and the report have it: "missed_grasp".
[[nodiscard]] std::string_view name(Fault fault);

// Where a fault strikes, and so which process can inject it.
enum class Strikes : std::uint8_t {
  kBody,    // the body, its cameras, its belt
  kBrain,   // the brain, or between it and the bridge
  kBridge,  // the bridge as a whole: in virtual time, or where it is a process of its own
  kLoops,   // the control loops as a whole: in virtual time only, for by the clock a simulated body dies with them
};
[[nodiscard]] Strikes strikes(Fault fault);

// How often, in the fault's own unit: a share of picks or parcels, or events an hour.
struct FaultRate {
  double often = 0;
  double shortest_s = 0, longest_s = 0;  // of an event
  double by_m = 0;                       // of kShiftedView
  double share = 1;                      // of kVacuumWeak: of the full vacuum
};

struct FaultPlan {
  std::string name = "none";
  std::array<FaultRate, kFaults> rates{};
  std::vector<Fault> left_out{};  // it has them, and who was given it cannot inject them

  [[nodiscard]] const FaultRate& operator[](Fault fault) const { return rates[static_cast<std::size_t>(fault)]; }
  [[nodiscard]] bool any() const;
  // Its faults that strike there never come.
  void leave_out(Strikes where);
};

// How often each was injected.
struct FaultCounts {
  std::array<std::int64_t, kFaults> of{};
  std::int64_t& operator[](Fault fault) { return of[static_cast<std::size_t>(fault)]; }
};

// What load_faults would read: `named`'s file, whether or not there is one. Nothing: none is needed.
[[nodiscard]] std::optional<std::filesystem::path> faults_file(const World& world, const std::string& named);

// Of the plans that a world has.
[[nodiscard]] std::vector<std::string> fault_plans(const World& world);

// `named` is "none", a plan by its name, of the world's folder faults/ or else of the one beside the worlds, or a
// file's path. Errors name file, line and key as those of world.yaml; no such plan, with the names that exist; a file
// none.yaml, whose runs nobody could tell from those without faults.
[[nodiscard]] Expected<FaultPlan> load_faults(const World& world, const std::string& named);

// A stream of random numbers for one fault, so that none reshuffles another, nor anything else that the run draws.
[[nodiscard]] Random fault_stream(std::uint64_t seed, Fault fault);

// When events of one kind are on: the waits between them are exponential, what they last is even between its bounds.
class Spells {
 public:
  Spells(const FaultRate& rate, Random random);
  // Whether one is on; times must not go back.
  [[nodiscard]] bool on(Time now);
  [[nodiscard]] std::int64_t begun() const { return begun_; }

 private:
  void draw(Time after);

  FaultRate rate_;
  Random random_;
  Time from_, until_;
  bool counted_ = false;
  std::int64_t begun_ = 0;
};

}  // namespace pons::world
