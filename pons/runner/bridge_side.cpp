#include "pons/runner/bridge_side.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "pons/cerebellum/cerebellum.hpp"
#include "pons/cerebellum/safety_machine.hpp"

namespace pons::runner {
namespace {

using bridge::Json;
using link::SafetyState;

// A stop whose cause has passed is left again after this long at standstill.
constexpr Duration kStandstillBeforeReset = std::chrono::milliseconds(500);
// A track is remembered as gone for this long: a frame taken before the grasp may still arrive.
constexpr std::size_t kGoneRemembered = 64;

}  // namespace

BridgeSide::BridgeSide(bridge::Bridge& bridge, brain::Dispatcher& dispatcher, SkillPort skills,
                       const std::vector<world::Zone>& zones, Recovery recovery, std::function<void(Time)> visitors)
    : bridge_(bridge),
      dispatcher_(dispatcher),
      skills_(std::move(skills)),
      zones_(zones),
      recovery_(recovery),
      visitors_(std::move(visitors)) {}

Expected<void> BridgeSide::take_over(const bridge::Journal& journal, Time now) {
  const auto tasks = journal.tasks();
  if (!tasks) return std::unexpected(tasks.error());
  for (const bridge::TaskRecord& record : *tasks) {
    dispatcher_.recall(record.task, record.outcome ? std::optional(record.outcome->outcome) : std::nullopt);
    if (record.outcome) last_outcome_ = std::max(last_outcome_, record.outcome->stamp);
  }
  const auto events = journal.events("");
  if (!events) return std::unexpected(events.error());
  for (const bridge::Event& event : *events) {
    if (event.kind == "ride") dispatcher_.recall_ride(event.detail.value("code", std::string{}));
    if (event.kind == "carries") carried_ = event.detail.value("load", Json{});
  }
  skills_.refresh(now, {});
  took_over_ = true;
  yielding_ = skills_.state().safety == SafetyState::kOperational;
  if (yielding_) skills_.halt();
  skills_.restore(carried_);
  return bridge_.recover(skills_.resume, now);
}

Expected<void> BridgeSide::tick(Time now, Observer& observer) {
  if (const auto snapshot = observer.collect(now, std::exchange(forgotten_, {}))) take_in(*snapshot, now);

  const double belt_travel_m = skills_.state().belt_travel_m;
  const std::vector<ObjectBelief> objects = predicted(seen_.objects, now, belt_travel_m);
  std::vector<ObjectBelief> obstacles = objects;
  std::ranges::copy(predicted(seen_.coming, now, belt_travel_m), std::back_inserter(obstacles));
  skills_.refresh(now, std::move(obstacles));
  look_around(now);
  if (auto good = look_after_arm(now); !good) return good;
  if (!stopping_) ask_brain(objects, now);
  if (visitors_) visitors_(now);

  bridge_.tick(now);
  if (bridge_.fault()) return std::unexpected(*bridge_.fault());
  if (bridge_.running().empty()) skills_.rest(now);
  note_carried(now);
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

// Durable at once: a bridge that comes after this one must know what hangs there.
void BridgeSide::note_carried(Time now) {
  Json carries = skills_.carries();
  if (carries == carried_) return;
  carried_ = std::move(carries);
  bridge_.note("carries", {{"load", carried_}}, now);
  bridge_.keep_notes(now);
}

// Who is where, into the journal.
void BridgeSide::look_around(Time now) {
  const std::uint32_t occupied = skills_.state().zones_occupied;
  for (std::size_t i = 0; i < zones_.size(); ++i) {
    const bool is = ((occupied >> i) & 1U) != 0, was = ((zones_occupied_ >> i) & 1U) != 0;
    if (is) occupied_at_[i] = now;
    if (is != was) bridge_.note("zone", {{"zone", zones_[i].name}, {"occupied", is}}, now);
  }
  zones_occupied_ = occupied;
}

bool BridgeSide::zones_are_empty(Time now) const {
  for (std::size_t i = 0; i < zones_.size(); ++i) {
    const world::Zone& zone = zones_[i];
    if (zone.speed_share > 0 || !occupied_at_[i]) continue;
    if (!zone.resume_after_s || now - *occupied_at_[i] < from_s(*zone.resume_after_s)) return false;
  }
  return true;
}

// From a stop at rest.
bool BridgeSide::may_resume(const link::State& state, Time now) const {
  const cerebellum::CauseRow* const row = cerebellum::cause_row(state.cause);
  if (row == nullptr || row->resumes == cerebellum::Resumes::kPerson) return false;
  if (row->resumes == cerebellum::Resumes::kZone && !zones_are_empty(now)) return false;
  return now - *stopped_since_ >= kStandstillBeforeReset;
}

Expected<void> BridgeSide::look_after_arm(Time now) {
  const link::State& state = skills_.state();
  yielding_ = yielding_ && state.safety == SafetyState::kOperational;
  const bool operational = state.safety == SafetyState::kOperational && !yielding_;
  if (operational && took_over_) {
    skills_.settle();
    took_over_ = false;
  }
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
    return {};
  }
  if (!stopped_since_) stopped_since_ = now;
  const bool recovers = state.safety == SafetyState::kRecovery;
  if (recovers || (state.safety == SafetyState::kDisarmed && skills_.outside_rad() > cerebellum::kArmTolerance_rad))
    return bring_in(now);
  if (state.safety == SafetyState::kDisarmed) {
    skills_.arm(now);
    return {};
  }
  const bool stopped =
      state.safety == SafetyState::kProtectiveStop && state.stop_result == link::StopResult::kConfirmed;
  if (stopped && may_resume(state, now)) skills_.arm(now);
  return {};
}

Expected<void> BridgeSide::bring_in(Time now) {
  const double outside_rad = skills_.outside_rad();
  if (recovery_ == Recovery::kRefused) {
    return fail(fmt::format("an axis stands {:.3f} rad outside its position limits", outside_rad), "arm",
                "see that its way in is clear and allow it with --recover, or bring it in by hand");
  }
  if (!recovering_) bridge_.note("recovery", {{"outside_rad", outside_rad}}, now);
  recovering_ = true;
  return skills_.recover(now);
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
