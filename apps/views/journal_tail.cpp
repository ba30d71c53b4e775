#include "apps/views/journal_tail.hpp"

namespace pons::apps {

// A journal that cannot be read ends the run by itself.
void JournalTail::show(Time) {
  using Until = bridge::Journal::Until;
  for (const Until until : {Until::kNewest, Until::kDurable}) {
    Listeners& listeners = until == Until::kDurable ? durable_ : written_;
    if (listeners.hears.empty()) continue;
    const auto events = journal_.since(listeners.after, kAtOnce, until);
    if (!events) continue;
    for (const bridge::Event& event : *events) {
      listeners.after = event.sequence;
      if (until == Until::kNewest && !event.task.empty()) continue;
      for (const Hears& hears : listeners.hears) hears(event);
    }
  }
}

}  // namespace pons::apps
