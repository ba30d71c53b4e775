// What happens, as the journal has it, event by event, to those views that tell of it.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "apps/views/outlets.hpp"
#include "pons/bridge/journal/journal.hpp"
#include "pons/core/time.hpp"

namespace pons::apps {

class JournalTail final : public View {
 public:
  // Events a period, so that ten thousand tasks that are taken at once do not keep the bridge: the rest follow.
  static constexpr std::int64_t kAtOnce = 64;
  using Hears = std::function<void(const bridge::Event& event)>;

  // From its newest event on. It outlives this.
  explicit JournalTail(const bridge::Journal& journal)
      : journal_(journal), durable_{.after = journal.durable()}, written_{.after = journal.durable()} {}
  // Of each event once it is durable.
  void add(Hears hears) { durable_.hears.push_back(std::move(hears)); }
  // Of those of no task once they are written: nobody was promised anything by them, and a stop is no news later.
  void add_at_once(Hears hears) { written_.hears.push_back(std::move(hears)); }
  // Before those that hear of it show what they have heard. Waits for the disk, for as long as a few rows take.
  void show(Time now) override;

 private:
  struct Listeners {
    std::int64_t after = 0;  // the newest event that they were told of
    std::vector<Hears> hears = {};
  };

  const bridge::Journal& journal_;
  Listeners durable_, written_;
};

}  // namespace pons::apps
