// A brain at the other end of a network that fails for a while: messages get lost, come late, and come twice. A fault
// (docs/decisions/0029-faults-as-data.md).
//
// Both ends do what honest ones do: whoever asks for a task sends it again, with the same words, until it hears the
// answer; outcomes and what rides are told again until the other end says that it has them. So the bridge may be asked
// for one task many times, late, and after it has ended.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "pons/brain/brain.hpp"
#include "pons/core/random.hpp"
#include "pons/core/time.hpp"
#include "pons/world/faults.hpp"

namespace pons::brain {

// What becomes of each message, of a whole run: it outlives the brains. Between the spells all arrive at once. Of the
// spells every third loses all of them, the others 30 to 90 %; the rest is late, one in five comes twice.
class Network {
 public:
  Network(const world::Spells& spells, const Random& random) : spells_(spells), random_(random) {}

  // How much later each copy of a message arrives that is sent now; none: it is lost. Times must not go back.
  [[nodiscard]] std::vector<Duration> send(Time now);
  // Of a message that nobody needs any more when it is late: whether it arrives.
  [[nodiscard]] bool passes(Time now);
  [[nodiscard]] std::int64_t spells() const { return spells_.begun(); }

 private:
  [[nodiscard]] bool loses(Time now);

  world::Spells spells_;
  Random random_;
  std::int64_t drawn_for_ = 0;
  double lost_ = 0;  // of the messages, in this spell
};

// Stands on the bridge's side for a brain on the other. One thread.
class FarBrain final : public Brain {
 public:
  // Both must outlive it.
  FarBrain(Brain& brain, Network& network) : brain_(brain), network_(network) {}

  [[nodiscard]] Decisions observe(const std::vector<ObjectBelief>& beliefs, Time now,
                                  const std::set<std::string>& set_aside) override;
  void taken_until(double x_m) override { brain_.taken_until(x_m); }
  bool heard(std::string_view id, task::Outcome outcome) override;
  void taken(const Json& task) override;
  bool refused(const Json& task, const Error& why) override;
  void recall(const task::Task& task, std::optional<task::Outcome> outcome) override;
  void recall_ride(std::string_view code) override;
  [[nodiscard]] std::vector<std::string> unseen() const override { return brain_.unseen(); }
  // Also while anything is to be told yet.
  [[nodiscard]] bool waits() const override;

 private:
  using Arrive = std::function<void()>;
  // What is told again until it is confirmed, and counts once.
  struct Told {
    Arrive arrive;
    Time again;
  };
  using Untold = std::map<std::uint64_t, Told>;

  void transmit(const Arrive& arrive);
  void deliver();
  void tell(Untold& untold, Arrive arrive) { untold.emplace(++told_, Told{std::move(arrive), {}}); }
  void tell_again(Untold& untold);
  void ask_again();
  void answered(const Json& task, Arrive then);

  Brain& brain_;
  Network& network_;
  Time now_;
  std::multimap<Time, Arrive> under_way_;
  std::uint64_t told_ = 0;
  std::set<std::uint64_t> received_;  // of those that are told again

  // The brain's end.
  struct Asked {
    Json task;
    Time again;
  };
  std::vector<Asked> unanswered_;
  Untold untold_rides_;
  bool belt_waits_ = false;  // as the brain wants it

  // The bridge's end.
  Untold untold_to_brain_;                    // outcomes, and what rode by the rules of the world
  Decisions arrived_;                         // since the last period
  std::set<std::string, std::less<>> known_;  // ids that have come
};

}  // namespace pons::brain
