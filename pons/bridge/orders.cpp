// What a bridge does with the order book that it shares with others.
#include <algorithm>
#include <set>
#include <string>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/open_task.hpp"

namespace pons::bridge {
namespace {

constexpr Duration kLookPeriod = std::chrono::milliseconds(100);
// What one bridge has claimed no other can run: it takes little more than it can begin, and gathers few that people
// have to allow, or that only a robot may run which waits for a person.
constexpr std::size_t kAhead = 4, kAskAhead = 64;

}  // namespace

void Bridge::take_orders(Time now) {
  const auto stopped = [](const Robot& robot) { return robot.emergency.has_value(); };
  const bool may = !fault_ && !stopping_ && !closed_ && !std::ranges::all_of(robots_, stopped) && !held();
  if (!may || now < look_at_) return;
  look_at_ = now + kLookPeriod;
  if (asking_.size() >= kAskAhead || open_.size() + kAhead > kMaxOpen) return;
  const std::set<std::string> aside = set_aside();
  std::size_t urgent = 0, others = 0, stuck = 0;
  for (const auto& [id, open] : open_) {
    if (open->stage != Open::Stage::kWaits) continue;
    if (aside.contains(id))
      ++stuck;
    else
      ++(open->task.priority >= urgent_priority_ ? urgent : others);
  }
  if (stuck >= kAskAhead) return;
  // An urgent one overtakes those that wait here already.
  const bool enough = urgent + others >= kAhead;
  const int least = enough ? urgent_priority_ : 0;
  const std::size_t waiting = enough ? urgent : others + urgent;
  if (waiting >= kAhead) return;
  const auto orders = journal_.claim(kAhead - waiting, least, ageing_);
  if (!orders) {
    set_fault(orders.error());
    return;
  }
  for (const Order& order : *orders) take_order(order, now);
}

// Claimed, it is this bridge's whatever comes of it: the claim becomes durable with what is written here.
void Bridge::take_order(const Order& order, Time now) {
  unkept_ = true;
  const auto admitted = admit_one(order.body, now);
  if (fault_) return;
  if (!admitted) {
    keep(journal_.close_order(order.id, task::Outcome::kFailed, admitted.error().line()));
    return;
  }
  if (admitted->accepted == Accepted::kNew) return;
  // Somebody had sent the same to this bridge itself, where it may have ended.
  const auto known = journal_.task(order.id);
  if (!known) {
    set_fault(known.error());
  } else if (*known && (*known)->record.outcome) {
    const OutcomeRecord& outcome = *(*known)->record.outcome;
    keep(journal_.close_order(order.id, outcome.outcome, outcome.reason));
  }
}

}  // namespace pons::bridge
