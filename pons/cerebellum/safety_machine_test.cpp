// The safety machine, exhaustively: every state with every event, every cause.
#include "pons/cerebellum/safety_machine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

namespace pons::cerebellum {
namespace {

using link::SafetyState;
using link::StopCause;
using Event = SafetyEvent;

std::vector<Event> events() {
  std::vector<Event> all;
  for (std::size_t i = 0; i < kSafetyEvents; ++i) all.push_back(static_cast<Event>(i));
  return all;
}

// Where an event leads, which may be nowhere else.
SafetyState after(SafetyState from, Event event) {
  const Transition* const row = transition(from, event);
  return row == nullptr ? from : row->to;
}

// How far a state is from taking motion; a stop may only lead further.
int hardness(SafetyState state) {
  switch (state) {
    case SafetyState::kStopping:
    case SafetyState::kProtectiveStop:
      return 1;
    case SafetyState::kEmergencyStopping:
    case SafetyState::kEmergencyStop:
      return 2;
    default:
      return 0;
  }
}

bool is_stop(Event event) {
  return event == Event::kProtectiveStop || event == Event::kEmergencyStop || event == Event::kPowerCut;
}

TEST(SafetyMachine, EveryStateAndEventHasAtMostOneRowAndAName) {
  std::set<std::pair<SafetyState, Event>> seen;
  std::set<std::string_view> names;
  for (const Transition& row : kTransitions) EXPECT_TRUE(seen.emplace(row.from, row.event).second);
  for (const SafetyState state : kSafetyStates) names.insert(link::name(state));
  for (const Event event : events()) names.insert(name(event));
  EXPECT_EQ(names.size(), kSafetyStates.size() + kSafetyEvents);
  EXPECT_FALSE(names.contains("unknown"));
  EXPECT_EQ(link::name(static_cast<SafetyState>(kSafetyStates.size())), "unknown") << "a state is not in the list";
  EXPECT_EQ(name(static_cast<Event>(kSafetyEvents)), "unknown") << "an event is not in the list";
}

// From any stop, along every chain of events: motion only after a reset and, later than that, arming.
TEST(SafetyMachine, NothingLeadsFromAStopToMotionButResetAndThenArm) {
  struct Way {
    SafetyState state;
    bool reset, armed;
    auto operator<=>(const Way&) const = default;
  };
  std::set<Way> seen;
  std::vector<Way> open;
  for (const SafetyState state : kSafetyStates) {
    if (hardness(state) > 0) {
      open.push_back({state, false, false});
    }
  }
  while (!open.empty()) {
    const Way way = open.back();
    open.pop_back();
    if (!seen.insert(way).second) continue;
    EXPECT_TRUE(!moves(way.state) || (way.reset && way.armed)) << link::name(way.state);
    for (const Event event : events()) {
      if (transition(way.state, event) == nullptr) continue;
      const bool reset = way.reset || event == Event::kReset;
      open.push_back({after(way.state, event), reset,
                      way.armed || (way.reset && (event == Event::kArm || event == Event::kRecover))});
    }
  }
  EXPECT_TRUE(std::ranges::any_of(seen, [](const Way& way) { return moves(way.state); })) << "it must be possible";
}

TEST(SafetyMachine, EveryStopIsTakenInEveryStateThatIsNotStoppedSoAlready) {
  for (const SafetyState state : kSafetyStates) {
    EXPECT_GE(hardness(after(state, Event::kProtectiveStop)), 1) << link::name(state);
    EXPECT_EQ(hardness(after(state, Event::kEmergencyStop)), 2) << link::name(state);
    EXPECT_EQ(after(state, Event::kPowerCut), SafetyState::kEmergencyStop) << link::name(state);
  }
}

TEST(SafetyMachine, EmergencyBeatsProtectiveInEveryState) {
  for (const SafetyState state : kSafetyStates) {
    for (const Event harder : {Event::kEmergencyStop, Event::kPowerCut}) {
      EXPECT_EQ(after(after(state, Event::kProtectiveStop), harder), after(state, harder)) << link::name(state);
      EXPECT_EQ(after(after(state, harder), Event::kProtectiveStop), after(state, harder)) << link::name(state);
    }
    EXPECT_GE(hardness(after(state, Event::kStandstill)), hardness(state)) << link::name(state);
  }
}

TEST(SafetyMachine, OnlyResetMakesAStopSofter) {
  for (const SafetyState state : kSafetyStates) {
    for (const Event event : events()) {
      if (event != Event::kReset) {
        EXPECT_GE(hardness(after(state, event)), hardness(state)) << link::name(state);
      }
      if (hardness(state) > 0 && event == Event::kReset) {
        EXPECT_FALSE(moves(after(state, event)));
      }
      if (is_braking(state) && event == Event::kReset) {
        EXPECT_EQ(after(state, event), state) << "it still moves";
      }
    }
  }
}

TEST(SafetyMachine, TheEpochGrowsExactlyAtEmergencyStops) {
  for (const SafetyState state : kSafetyStates) {
    for (const Event event : events()) {
      const Transition* const row = transition(state, event);
      if (row == nullptr) continue;
      EXPECT_EQ(row->epochs, !is_emergency(state) && is_emergency(row->to) ? 1U : 0U)
          << link::name(state) << ", " << name(event);
    }
  }
}

// All that events can reach: power, state and epoch belong together.
TEST(SafetyMachine, PowerIsOnlyWhereTheStateAllowsIt) {
  std::set<std::pair<SafetyState, bool>> seen;
  std::vector<SafetyMachine> open{SafetyMachine{}};
  while (!open.empty()) {
    const SafetyMachine machine = open.back();
    open.pop_back();
    if (!seen.emplace(machine.state(), machine.powered()).second) continue;
    if (moves(machine.state())) {
      EXPECT_TRUE(machine.powered()) << link::name(machine.state());
    }
    if (machine.state() == SafetyState::kEmergencyStop) {
      EXPECT_FALSE(machine.powered());
    }
    for (const Event event : events()) {
      SafetyMachine next = machine;
      const Transition* const row = next.apply(event);
      EXPECT_EQ(row, transition(machine.state(), event));
      EXPECT_EQ(next.epoch(), machine.epoch() + (row == nullptr ? 0 : row->epochs));
      if (next.powered() && !machine.powered()) {
        EXPECT_TRUE(event == Event::kArm || event == Event::kRecover) << "power is asked for, never taken";
      }
      open.push_back(next);
    }
  }
  for (const SafetyState state : kSafetyStates) {
    EXPECT_TRUE(seen.contains({state, false}) || seen.contains({state, true}))
        << link::name(state) << " is never reached";
  }
}

TEST(SafetyMachine, EveryCauseIsOneStop) {
  EXPECT_EQ(cause_row(StopCause::kNone), nullptr);
  std::size_t causes = 0;
  for (int i = 1; link::name(static_cast<StopCause>(i)) != "unknown"; ++i, ++causes) {
    const CauseRow* const row = cause_row(static_cast<StopCause>(i));
    ASSERT_NE(row, nullptr) << link::name(static_cast<StopCause>(i));
    EXPECT_TRUE(is_stop(row->event)) << link::name(row->cause);
    EXPECT_FALSE(row->when.empty());
    EXPECT_NE(name(row->resumes), "unknown");
    // Nobody but a person takes back what raised the epoch.
    if (row->event != Event::kProtectiveStop) {
      EXPECT_EQ(row->resumes, Resumes::kPerson) << link::name(row->cause);
    }
  }
  EXPECT_EQ(causes, kCauses.size());
}

}  // namespace
}  // namespace pons::cerebellum
