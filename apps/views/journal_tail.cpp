#include "apps/views/journal_tail.hpp"

namespace pons::apps {

// A journal that cannot be read ends the run by itself.
void JournalTail::show(Time) {
  const bridge::Journal& journal = bridge_.journal();
  for (Listeners* const listeners : {&written_, &kept_}) {
    if (listeners->hears.empty()) continue;
    const std::int64_t last = listeners == &kept_ ? bridge_.kept() : journal.newest();
    const auto events = journal.since(listeners->after, last, kAtOnce);
    if (!events) continue;
    for (const bridge::Event& event : *events) {
      listeners->after = event.sequence;
      if (listeners == &written_ && !event.task.empty()) continue;
      for (const Hears& hears : listeners->hears) hears(event);
    }
  }
}

}  // namespace pons::apps
