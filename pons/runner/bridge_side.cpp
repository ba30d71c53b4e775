#include "pons/runner/bridge_side.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "pons/cerebellum/safety_machine.hpp"

namespace pons::runner {
namespace {

using bridge::Json;
using link::SafetyState;
using link::StopCause;

// A stop whose cause has passed is left again after this long at standstill.
constexpr Duration kStandstillBeforeReset = std::chrono::milliseconds(500);
// A track is remembered as gone for this long: a frame taken before the grasp may still arrive.
constexpr std::size_t kGoneRemembered = 64;

bool needs_person(StopCause cause) {
  const cerebellum::CauseRow* const row = cerebellum::cause_row(cause);
  return row != nullptr && row->resumes == cerebellum::Resumes::kPerson;
}

}  // namespace

BridgeSide::BridgeSide(bridge::Bridge& bridge, brain::Dispatcher& dispatcher, SkillPort skills,
                       std::function<void(Time)> visitors)
    : bridge_(bridge), dispatcher_(dispatcher), skills_(std::move(skills)), visitors_(std::move(visitors)) {}

Expected<void> BridgeSide::tick(Time now, CameraCrew& crew) {
  auto snapshot = crew.collect(now, std::exchange(forgotten_, {}));
  if (!snapshot) return std::unexpected(snapshot.error());
  if (*snapshot) take_in(**snapshot, now);

  const double belt_travel_m = skills_.state().belt_travel_m;
  const std::vector<ObjectBelief> objects = predicted(seen_.objects, now, belt_travel_m);
  std::vector<ObjectBelief> obstacles = objects;
  std::ranges::copy(predicted(seen_.coming, now, belt_travel_m), std::back_inserter(obstacles));
  skills_.refresh(now, std::move(obstacles));
  look_after_arm(now);
  if (!stopping_) ask_brain(objects, now);
  if (visitors_) visitors_(now);

  bridge_.tick(now);
  if (bridge_.fault()) return std::unexpected(*bridge_.fault());
  if (bridge_.running().empty()) skills_.rest(now);
  for (const bridge::OutcomeReport& report : bridge_.take_outcomes()) {
    if (dispatcher_.heard(report.id, report.outcome)) last_outcome_ = now;
  }
  for (const std::uint32_t track : skills_.take_forgotten()) {
    gone_.push_back(track);
    forgotten_.push_back(track);
  }
  if (gone_.size() > kGoneRemembered) gone_.erase(gone_.begin(), gone_.end() - kGoneRemembered);
  return {};
}

void BridgeSide::take_in(const Snapshot& snapshot, Time now) {
  for (const auto& [place, count] : snapshot.occupancy) {
    const auto before = seen_.occupancy.find(place);
    if (count > (before == seen_.occupancy.end() ? 0 : before->second)) {
      bridge_.note("fell", {{"place", place}, {"things", count}}, now);
    }
  }
  seen_ = snapshot;
}

std::vector<ObjectBelief> BridgeSide::predicted(const std::vector<ObjectBelief>& seen, Time now,
                                                double belt_travel_m) const {
  std::vector<ObjectBelief> objects;
  for (ObjectBelief object : seen) {
    if (std::find(gone_.begin(), gone_.end(), object.track) != gone_.end()) continue;
    if (object.velocity_m_s.x() != 0) {
      object.world_from_top.translation().x() += belt_travel_m - seen_.belt_travel_m;
      object.velocity_m_s.x() = skills_.state().belt_speed_m_s;
    }
    object.stamp = now;
    objects.push_back(std::move(object));
  }
  return objects;
}

void BridgeSide::ask_brain(const std::vector<ObjectBelief>& objects, Time now) {
  const brain::Decisions decisions = dispatcher_.observe(objects, now);
  for (const Json& task : decisions.tasks) {
    if (auto admitted = bridge_.submit(task.dump(), now); !admitted) {
      const auto id = task.at("id").get<std::string>();
      const std::string& code = task.at("steps").at(0).at("arguments").at("object").get_ref<const std::string&>();
      bridge_.note("ride", {{"code", code}, {"reason", "refused: " + admitted.error().line()}}, now);
      dispatcher_.heard(id, task::Outcome::kFailed);  // asked for again under another id, if it comes by
    }
  }
  for (const brain::Ride& ride : decisions.rides) {
    if (ride.code.empty()) ++unlabelled_;
    bridge_.note("ride", {{"track", ride.track}, {"code", ride.code}, {"reason", ride.reason}}, now);
  }
}

void BridgeSide::look_after_arm(Time now) {
  const link::State& state = skills_.state();
  const bool operational = state.safety == SafetyState::kOperational;
  bridge_.hold(operational ? bridge::Bridge::Hold::kOff : bridge::Bridge::Hold::kOn);
  if (was_operational_ && !operational) {
    ++stops_;
    bridge_.note("stop", {{"state", link::name(state.safety)}, {"cause", link::name(state.cause)}}, now);
  } else if (!was_operational_ && operational) {
    bridge_.note("armed", {{"epoch", state.epoch}}, now);
  }
  was_operational_ = operational;
  if (operational) {
    stopped_since_.reset();
    return;
  }
  if (!stopped_since_) stopped_since_ = now;
  if (state.safety == SafetyState::kDisarmed) {
    skills_.arm(now);
    return;
  }
  const bool stopped =
      state.safety == SafetyState::kProtectiveStop && state.stop_result == link::StopResult::kConfirmed;
  if (stopped && !needs_person(state.cause) && now - *stopped_since_ >= kStandstillBeforeReset) skills_.arm(now);
}

void BridgeSide::stop(Time now, const std::string& reason) {
  if (stopping_) return;
  stopping_ = true;
  bridge_.note("shutdown", {{"reason", reason}}, now);
  bridge_.stop(now, reason);
}

bool BridgeSide::idle() const { return bridge_.idle(); }

void BridgeSide::close(Time now) {
  const std::vector<std::string> unseen = dispatcher_.unseen();
  for (const std::string& code : unseen) {
    bridge_.note("ride",
                 {{"code", code}, {"reason", stopping_ ? "not seen before the run was stopped" : "never identified"}},
                 now);
  }
  bridge_.note("closed", {{"never_identified", unseen.size()}, {"unlabelled_rides", unlabelled_}}, now);
}

}  // namespace pons::runner
