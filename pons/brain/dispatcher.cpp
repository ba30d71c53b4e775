#include "pons/brain/dispatcher.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "pons/world/mouth.hpp"
#include "pons/world/view.hpp"

namespace pons::brain {
namespace {

constexpr int kFramesToTrust = 3;
constexpr int kMostTries = 3;
constexpr Duration kAskAgainAfter = std::chrono::milliseconds(800);
constexpr double kBeltStands_s = 3600;                      // for so long at most, altogether, while a task waits
constexpr int kLooks = 2;                                   // at a bare label: it cannot be read
constexpr Duration kWaitsToRead = std::chrono::seconds(6);  // for one to be taken that lies on another, and to look
constexpr double kNearBorder_m = 0.04;  // of the view: what stands on the belt leaves it sooner than its surface
constexpr double kStopsShort_m = 0.01;  // of that
constexpr double kUpstream_m = 0.15;    // nothing rides back, but what is believed may jump a little
constexpr double kTaskTakes_s = 3.0, kPickTakes_s = 1.4;  // roughly, of an arm

double label_view_end_m(const world::World& world) {
  std::optional<double> end;
  for (const world::CameraSpec& camera : world.cameras) {
    if (!camera.reads_labels) continue;
    if (const auto seen = world::seen_of_belt(camera, world.belt)) end = std::max(end.value_or(seen->to_m), seen->to_m);
  }
  return end.value_or(world.belt.pick_x_max_m);
}

// For how long after a frame its label may still be on the way to us.
double reading_delay_s(const world::World& world) {
  double delay_s = 0;
  for (const world::CameraSpec& camera : world.cameras) {
    if (camera.reads_labels) delay_s = std::max(delay_s, camera.latency_s + camera.period_s);
  }
  return delay_s;
}

double speed_m_s(const ObjectBelief& belief, const world::Belt& belt) {
  const double seen = belief.velocity_m_s.x();
  return std::max(seen > 0 ? seen : belt.speed_m_s, belt.speed_m_s * (1 - belt.speed_variation));
}

double left_s(const ObjectBelief& belief, const world::Belt& belt) {
  return (belt.pick_x_max_m - belief.world_from_top.translation().x()) / speed_m_s(belief, belt);
}

std::string id_of(const std::string& code, int tries) { return tries == 1 ? code : code + "." + std::to_string(tries); }

bool covers(const ObjectBelief& other, const ObjectBelief& belief) {
  return lies_on(other, belief) || is_part(other, belief);
}

}  // namespace

Dispatcher::Dispatcher(Orders orders, const world::World& world)
    : orders_(std::move(orders)), world_(world), belt_(world.belt), label_view_end_m_(brain::label_view_end_m(world)) {}

bool Dispatcher::heard(std::string_view id, task::Outcome outcome) {
  const auto asked = asked_.find(id);
  if (asked == asked_.end()) return false;
  Known& known = known_.find(asked->second)->second;
  asked_.erase(asked);  // one outcome each: a refused id is somebody else's, and so is what becomes of it
  known.asked = false;
  known.sorted = outcome == task::Outcome::kSucceeded;
  known.failed = outcome == task::Outcome::kFailed && known.tries < kMostTries;
  if (known.failed) decided_.erase(known.track);
  ++tally_.settled;
  if (known.sorted) ++tally_.sorted;
  return true;
}

void Dispatcher::recall(const task::Task& task, std::optional<task::Outcome> outcome) {
  if (task.steps.empty() || task.steps.front().skill != "pick") return;
  const std::string code = task.steps.front().arguments.value("object", std::string{});
  if (!orders_.contains(code)) return;
  Known& known = known_[code];
  int number = known.tries + 1;  // one that was refused is in no journal
  while (number <= kMostTries && task.id != id_of(code, number)) ++number;
  if (number > kMostTries) return;
  if (known.tries > 0 || known.rode) --tally_.settled;
  known.tries = number;
  known.asked = true;
  known.failed = false;
  asked_.emplace(task.id, code);
  if (outcome) heard(task.id, *outcome);
}

void Dispatcher::recall_ride(std::string_view code) { let_ride(std::string(code)); }

Decisions Dispatcher::observe(const std::vector<ObjectBelief>& beliefs, Time now,
                              const std::set<std::string>& set_aside) {
  Decisions decisions;
  for (const ObjectBelief& belief : beliefs) {
    if (!decided_.contains(belief.track)) decide(belief, beliefs, now, decisions);
    follow(belief);
    if (!decisions.belt_waits) decisions.belt_waits = is_to_be_read(belief, beliefs, now, set_aside);
    if (decisions.belt_waits || !would_ride_past(belief)) continue;
    const bool may_be_asked_for = !decided_.contains(belief.track) && orders_.contains(belief.code);
    decisions.belt_waits =
        is_waited_for(belief, now, set_aside) || (may_be_asked_for && will_be_bare(belief, beliefs, now, set_aside));
  }
  return decisions;
}

void Dispatcher::decide(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now,
                        Decisions& decisions) {
  const double x_m = belief.world_from_top.translation().x();
  const bool in_reach = x_m <= belt_.pick_x_max_m;
  if (!belief.disputed.empty()) {
    // It may be two that touch: as long as a camera looks, they may still be told apart.
    if (in_reach && x_m < label_view_end_m_) return;
    return ride(belief, kRideTwoCodes, decisions);
  }
  if (belief.code.empty()) {
    if (in_reach && !past_label_view(belief)) return;
    return ride(belief, kRideUnreadable, decisions);
  }
  if (in_reach && belief.frames_seen < kFramesToTrust) return;

  const auto order = orders_.find(belief.code);
  if (order == orders_.end()) return ride(belief, kRideUnknown, decisions);
  Known& known = known_[belief.code];
  if (known.tries > 0 && !known.failed) {
    const bool live = std::ranges::find(all, known.track, &ObjectBelief::track) != all.end();
    if (live || known.sorted) return ride(belief, kRideTwice, decisions);
    // The earlier track was lost, not the parcel: its task stands.
    known.track = belief.track;
    decided_.insert(belief.track);
    return;
  }
  // Asked for, it would be sorted as the one that rides into the exception chute.
  if (known.tries == 0 && known.rode_to_m && x_m < *known.rode_to_m - kUpstream_m)
    return ride(belief, kRideTwice, decisions);
  if (too_large(belief.size_m, order->second)) {
    if (in_reach && x_m < label_view_end_m_) return;  // it, too, may be two
    return ride(belief, kRideTooLarge, decisions);
  }
  if (!in_reach) return ride(belief, kRideLate, decisions);
  if (known.failed) {
    // What was in its way may have gone by then; meanwhile the arm takes another.
    if (!known.seen_again) known.seen_again = now;
    if (now - *known.seen_again < kAskAgainAfter) return;
  }
  if (std::ranges::any_of(all, [&](const ObjectBelief& other) { return covers(other, belief); })) {
    // Taken now, what lies on it would come along. As long as a camera looks, it may still see it bare.
    if (x_m < label_view_end_m_ || will_be_bare(belief, all, now, {})) return;
    return ride(belief, kRideCovered, decisions);
  }
  if (belief.half_seen) {
    if (!past_label_view(belief)) return;
    return ride(belief, kRideHalfSeen, decisions);
  }
  if (order->second.priority >= kExpressPriority && must_wait(belief, all)) return;
  decided_.insert(belief.track);
  if (known.tries > 0 || known.rode) --tally_.settled;
  known.track = belief.track;
  known.asked = true;
  known.failed = false;
  known.seen_again.reset();
  ++known.tries;
  decisions.tasks.push_back(task_for(belief, order->second, known.tries, now));
  asked_.emplace(decisions.tasks.back().at("id").get<std::string>(), belief.code);
}

bool Dispatcher::too_large(const Vector3& size_m, const Order& order) const {
  if (world_.rules.too_large(size_m)) return true;
  const world::Place* const chute = world_.place(order.destination);
  return chute != nullptr && world::ways_in(size_m, *chute, world::kMisjudged_m).empty();
}

bool Dispatcher::must_wait(const ObjectBelief& express, const std::vector<ObjectBelief>& all) const {
  const world::Belt& belt = belt_;
  const double x_m = express.world_from_top.translation().x();
  std::vector<double> ahead_s;  // that those have which it would overtake
  for (const ObjectBelief& other : all) {
    const auto known = known_.find(other.code);
    if (known == known_.end() || !known->second.asked || other.world_from_top.translation().x() <= x_m) continue;
    ahead_s.push_back(left_s(other, belt));
  }
  std::ranges::sort(ahead_s);
  const auto turn_s = [](std::size_t place) { return static_cast<double>(place) * kTaskTakes_s + kPickTakes_s; };
  // The arm would only stand and wait for it to come into the zone.
  if (!ahead_s.empty() && (belt.pick_x_min_m - x_m) / speed_m_s(express, belt) > kPickTakes_s) return true;
  std::size_t place = 0;
  bool costs_one = false;
  for (const double other_s : ahead_s) {
    if (other_s < turn_s(place)) continue;  // rides past either way, and takes no turn of the arm
    costs_one = costs_one || other_s < turn_s(place + 1);
    ++place;
  }
  return costs_one && left_s(express, belt) >= turn_s(place);
}

bool Dispatcher::past_label_view(const ObjectBelief& belief) const {
  const double half_m = std::max(belief.size_m.x(), belief.size_m.y()) / 2;
  const double on_the_way_m = reading_delay_s(world_) * speed_m_s(belief, belt_);
  return belief.world_from_top.translation().x() > label_view_end_m_ + half_m + on_the_way_m;
}

// Where the belt must stop now to keep it in the zone.
bool Dispatcher::would_ride_past(const ObjectBelief& belief) const {
  return belt_.must_wait_for(belief.world_from_top.translation().x(), std::max(belief.velocity_m_s.x(), 0.0));
}

bool Dispatcher::is_waited_for(const ObjectBelief& belief, Time now, const std::set<std::string>& set_aside) const {
  const auto known = known_.find(belief.code);
  if (known == known_.end()) return false;
  const std::optional<Time>& again = known->second.seen_again;
  const bool soon = known->second.failed && again && now - *again < kAskAgainAfter;
  return (known->second.asked || soon) && !set_aside.contains(id_of(belief.code, known->second.tries));
}

bool Dispatcher::will_be_bare(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now,
                              const std::set<std::string>& set_aside) const {
  return std::ranges::any_of(
      all, [&](const ObjectBelief& other) { return covers(other, belief) && is_waited_for(other, now, set_aside); });
}

bool Dispatcher::is_to_be_read(const ObjectBelief& belief, const std::vector<ObjectBelief>& all, Time now,
                               const std::set<std::string>& set_aside) {
  const bool unread = belief.code.empty() && belief.disputed.empty() && belief.label_attempts < kLooks;
  if (!(unread || belief.half_seen) || decided_.contains(belief.track)) return false;
  if (will_be_bare(belief, all, now, set_aside)) to_be_read_.try_emplace(belief.track);
  // Half seen and bare, it was beside something taller or the arm: the next look shows all of it.
  const bool bare =
      belief.half_seen && std::ranges::none_of(all, [&](const ObjectBelief& other) { return covers(other, belief); });
  if (!bare && !to_be_read_.contains(belief.track)) return false;
  const Eigen::Vector2d along = belief.world_from_top.linear().row(0).head<2>().cwiseAbs();
  const double front_m = belief.world_from_top.translation().x() + 0.5 * along.dot(belief.size_m.head<2>());
  const double stops_m = belt_.stops_within_m(std::max(belief.velocity_m_s.x(), 0.0));
  const double end_m = label_view_end_m_ - kNearBorder_m;
  if (front_m > end_m || front_m + stops_m < end_m - kStopsShort_m) return false;
  std::optional<Time>& since = to_be_read_[belief.track];
  if (!since) since = now;
  return now - *since < kWaitsToRead;
}

Json Dispatcher::task_for(const ObjectBelief& belief, const Order& order, int tries, Time now) const {
  const world::Belt& belt = belt_;
  // At the belt's nominal speed: by what it runs at just now, one asked for later could seem to leave sooner.
  const double nominal_s = (belt.pick_x_max_m - belief.world_from_top.translation().x()) / belt.speed_m_s;
  return {{"id", id_of(belief.code, tries)},
          {"order", belief.code},
          {"priority", order.priority >= kExpressPriority ? order.priority : kOrdinaryPriority},
          {"deadline_s", now.s() + nominal_s + kBeltStands_s},
          {"steps",
           {{{"skill", "pick"}, {"arguments", {{"object", belief.code}}}},
            {{"skill", "place"}, {"arguments", {{"place", order.destination}, {"object", belief.code}}}}}}};
}

void Dispatcher::ride(const ObjectBelief& belief, std::string_view reason, Decisions& decisions) {
  decided_.insert(belief.track);
  const auto entry = [&](const std::string& code) {
    decisions.rides.push_back({belief.track, code, std::string(reason)});
  };
  // Either code may be its own: whoever looks for that parcel finds the entry.
  for (const std::string& code : belief.disputed) let_ride(code), entry(code);
  if (belief.disputed.empty()) let_ride(belief.code), entry(belief.code);
  if (belief.code.empty()) return;
  std::optional<double>& rode_to_m = known_[belief.code].rode_to_m;
  rode_to_m =
      std::max(rode_to_m.value_or(-std::numeric_limits<double>::infinity()), belief.world_from_top.translation().x());
}

void Dispatcher::follow(const ObjectBelief& belief) {
  const auto known = known_.find(belief.code);
  if (known == known_.end() || !known->second.rode_to_m) return;
  double& rode_to_m = *known->second.rode_to_m;
  rode_to_m = std::max(rode_to_m, belief.world_from_top.translation().x());
}

void Dispatcher::let_ride(const std::string& code) {
  if (code.empty()) {
    ++tally_.settled;
    return;
  }
  Known& known = known_[code];
  if (known.tries == 0 && !known.rode) ++tally_.settled;
  known.rode = true;
}

std::vector<std::string> Dispatcher::unseen() const {
  std::vector<std::string> codes;
  for (const auto& [code, order] : orders_) {
    const auto known = known_.find(code);
    if (known == known_.end() || (known->second.tries == 0 && !known->second.rode)) codes.push_back(code);
  }
  return codes;
}

}  // namespace pons::brain
