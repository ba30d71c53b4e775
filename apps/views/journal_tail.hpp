// What happens, as the journal has it, event by event, to those views that tell of it.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/bridge/bridge.hpp"
#include "pons/core/time.hpp"

namespace pons::apps {

class JournalTail final : public View {
 public:
  // Events a period, so that ten thousand tasks that are taken at once do not keep the bridge: the rest follow.
  static constexpr std::int64_t kAtOnce = 64;
  using Hears = std::function<void(const bridge::Event& event)>;

  // Of its journal, from the last durable event on. It outlives this.
  explicit JournalTail(const bridge::Bridge& bridge)
      : bridge_(bridge), kept_{.after = bridge.journal().durable()}, written_{.after = bridge.journal().durable()} {}
  // Of each event once the bridge has kept it.
  void add(Hears hears) { kept_.hears.push_back(std::move(hears)); }
  // Of those of no task once they are written: nobody was promised anything by them, and a stop is no news later.
  void add_at_once(Hears hears) { written_.hears.push_back(std::move(hears)); }
  // Before those that hear of it show what they have heard. Waits for the disk, for as long as a few rows take.
  void show(Time now) override;

 private:
  struct Listeners {
    std::int64_t after = 0;  // the newest event that they were told of
    std::vector<Hears> hears = {};
  };

  const bridge::Bridge& bridge_;
  Listeners kept_, written_;
};

}  // namespace pons::apps
