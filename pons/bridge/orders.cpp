// What a bridge does with the order book that it shares with others.
#include <algorithm>

#include "pons/bridge/bridge.hpp"
#include "pons/bridge/open_task.hpp"

namespace pons::bridge {
namespace {

constexpr Duration kLookPeriod = std::chrono::milliseconds(100);
// What one bridge has claimed no other can run: it takes little more than it can begin, and gathers few that people
// have to allow.
constexpr std::size_t kAhead = 4, kAskAhead = 64;

}  // namespace

void Bridge::take_orders(Time now) {
  const bool may = !fault_ && !stopping_ && !closed_ && !std::ranges::all_of(robots_, &Robot::emergency) && !held();
  if (!may || now < look_at_) return;
  look_at_ = now + kLookPeriod;
  if (asking_.size() >= kAskAhead || open_.size() + kAhead > kMaxOpen) return;
  std::size_t waiting = arbiter_.queue_length();
  int least = 0;
  if (waiting >= kAhead) {
    // An urgent one overtakes those that wait here already.
    least = urgent_priority_;
    waiting = static_cast<std::size_t>(std::ranges::count_if(open_, [least](const auto& entry) {
      return entry.second->stage == Open::Stage::kWaits && entry.second->task.priority >= least;
    }));
  }
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
