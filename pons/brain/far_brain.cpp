#include "pons/brain/far_brain.hpp"

#include <algorithm>

#include "pons/task/json_value.hpp"

namespace pons::brain {
namespace {

constexpr Duration kAgain = std::chrono::milliseconds(500);
constexpr double kLatest_s = 2.0, kLosesAll = 1.0 / 3, kLeast = 0.3, kMost = 0.9, kTwice = 0.2;

}  // namespace

bool Network::loses(Time now) {
  if (!spells_.on(now)) return false;
  if (drawn_for_ != spells_.begun()) {
    drawn_for_ = spells_.begun();
    const bool all = random_.uniform() < kLosesAll;
    const double some = random_.uniform(kLeast, kMost);
    lost_ = all ? 1 : some;
  }
  return true;
}

std::vector<Duration> Network::send(Time now) {
  if (!loses(now)) return {Duration{0}};
  if (random_.uniform() < lost_) return {};
  std::vector<Duration> copies{from_s(random_.uniform(0, kLatest_s))};
  if (random_.uniform() < kTwice) copies.push_back(from_s(random_.uniform(0, kLatest_s)));
  return copies;
}

bool Network::passes(Time now) { return !loses(now) || random_.uniform() >= lost_; }

Decisions FarBrain::observe(const std::vector<ObjectBelief>& beliefs, Time now,
                            const std::set<std::string>& set_aside) {
  now_ = now;
  tell_again(untold_to_brain_);
  deliver();
  // An older picture of the world is worth nothing once there is a newer one, and so is an older word on the belt.
  const bool asked = network_.passes(now);
  if (asked) {
    Decisions decisions = brain_.observe(beliefs, now, set_aside);
    belt_waits_ = decisions.belt_waits;
    for (Json& task : decisions.tasks) unanswered_.push_back({std::move(task), now});
    for (Ride& ride : decisions.rides)
      tell(untold_rides_, [this, ride = std::move(ride)] { arrived_.rides.push_back(ride); });
  }
  ask_again();
  tell_again(untold_rides_);
  deliver();
  Decisions arrived = std::exchange(arrived_, {});
  arrived.silent = !asked || !network_.passes(now);
  arrived.belt_waits = belt_waits_;
  return arrived;
}

bool FarBrain::heard(std::string_view id, task::Outcome outcome) {
  tell(untold_to_brain_, [this, id = std::string(id), outcome] { brain_.heard(id, outcome); });
  return known_.contains(id);
}

void FarBrain::taken(const Json& task) {
  answered(task, [this, task] { brain_.taken(task); });
}

// That it rides, the brain says itself when it hears of it.
bool FarBrain::refused(const Json& task, const Error& why) {
  answered(task, [this, task, why] {
    if (!brain_.refused(task, why)) return;
    const Ride ride{0, code_of(task), "refused: " + why.line()};
    tell(untold_rides_, [this, ride] { arrived_.rides.push_back(ride); });
  });
  return false;
}

// Who has heard one answer does not ask again, and listens to no other.
void FarBrain::answered(const Json& task, Arrive then) {
  transmit([this, task, then = std::move(then)] {
    const auto asked = std::ranges::find(unanswered_, task, &Asked::task);
    if (asked == unanswered_.end()) return;
    unanswered_.erase(asked);
    then();
  });
}

void FarBrain::recall(const task::Task& task, std::optional<task::Outcome> outcome) {
  known_.insert(task.id);
  brain_.recall(task, outcome);
}

void FarBrain::recall_ride(std::string_view code) {
  tell(untold_to_brain_, [this, code = std::string(code)] { brain_.recall_ride(code); });
}

bool FarBrain::waits() const {
  return brain_.waits() || !unanswered_.empty() || !untold_rides_.empty() || !untold_to_brain_.empty();
}

void FarBrain::transmit(const Arrive& arrive) {
  for (const Duration later : network_.send(now_)) under_way_.emplace(now_ + later, arrive);
}

// What arrives may make somebody say something, which arrives in the same period where nothing holds it up.
void FarBrain::deliver() {
  while (!under_way_.empty() && under_way_.begin()->first <= now_) {
    const Arrive arrive = std::move(under_way_.begin()->second);
    under_way_.erase(under_way_.begin());
    arrive();
  }
}

void FarBrain::ask_again() {
  for (Asked& asked : unanswered_) {
    if (now_ < asked.again) continue;
    asked.again = now_ + kAgain;
    transmit([this, task = asked.task] {
      known_.insert(task::text_of(task, "id"));
      arrived_.tasks.push_back(task);
    });
  }
}

void FarBrain::tell_again(Untold& untold) {
  for (auto& [number, told] : untold) {
    if (now_ < told.again) continue;
    told.again = now_ + kAgain;
    transmit([this, &untold, number = number, arrive = told.arrive] {
      if (received_.insert(number).second) arrive();
      transmit([&untold, number] { untold.erase(number); });
    });
  }
}

}  // namespace pons::brain
