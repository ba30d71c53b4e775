#include "pons/runner/bridge_side.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "pons/bridge/journal/story.hpp"
#include "pons/task/json_value.hpp"

namespace pons::runner {
namespace {

using bridge::Json;

// A track is remembered as gone for this long: a frame taken before the grasp may still arrive.
constexpr std::size_t kGoneRemembered = 64;

constexpr std::string_view kToRest = "the robot is to rest";

}  // namespace

BridgeSide::BridgeSide(bridge::Bridge& bridge, brain::Brain& brain, std::vector<SkillPort> robots,
                       const world::World& world, Recovery recovery, std::function<void(Time)> visitors)
    : world_(world),
      bridge_(bridge),
      brain_(brain),
      health_([this](std::string_view part, const PartHealth& health, Time now) {
        bridge_.note("health", {{"part", part}, {"condition", name(health.condition)}, {"why", health.why}}, now);
      }),
      vitals_(world, health_),
      visitors_(std::move(visitors)) {
  const auto one_of = robots.size() > 1 ? RobotVitals::OneOf::kSeveral : RobotVitals::OneOf::kOne;
  for (SkillPort& port : robots) {
    const std::string name = port.name;
    robots_.push_back(std::make_unique<Robot>(bridge, std::move(port), world.zones, recovery,
                                              RobotVitals(world.robot, name, one_of, health_)));
  }
}

Expected<void> BridgeSide::take_over(const bridge::Journal& journal, Time now) {
  // Of a body that is gone, only the ids that its tasks have taken are still so.
  std::int64_t since = 0;
  auto read = journal.each_note([&since](const bridge::Event& event) -> Expected<void> {
    if (event.kind == bridge::kBodyGoneEvent) since = event.run;
    return {};
  });
  if (!read) return read;
  decided_ = brain_heard_ = now;  // nobody was there to hear it
  read = journal.each_task([&](const bridge::TaskRecord& record) -> Expected<void> {
    brain_.recall(record.task, record.outcome ? std::optional(record.outcome->outcome) : std::nullopt);
    if (!record.outcome) asked_.emplace(record.task.id, record.task.order);
    if (record.outcome && record.outcome->run >= since) last_outcome_ = std::max(last_outcome_, record.outcome->stamp);
    return {};
  });
  if (!read) return read;
  read = journal.each_note([&](const bridge::Event& event) -> Expected<void> {
    if (event.run >= since) recall(event);
    return {};
  });
  if (!read) return read;
  for (const auto& robot : robots_) {
    robot->skills.refresh(now, {}, seen_.belt_seen);
    robot->arming.take_over(now, robot->armed_before);
    robot->skills.restore(robot->carried);
  }
  std::vector<bridge::Resume> resumes;
  for (const auto& robot : robots_) resumes.push_back(robot->skills.resume);
  return bridge_.recover(resumes, now);
}

void BridgeSide::recall(const bridge::Event& note) {
  if (note.kind == "ride") brain_.recall_ride(task::text_of(note.detail, "code"));
  if (note.kind == "rest") resting_ = note.detail.value("rests", false);
  const std::string of = task::text_of(note.detail, "robot");
  for (const auto& robot : robots_) {
    if (!of.empty() && of != robot->skills.name) continue;
    robot->armed_before = robot->armed_before || note.kind == "armed";
    if (note.kind == "person") robot->arming.recall(task::text_of(note.detail, "asks"));
    if (note.kind == bridge::kCarriesEvent) robot->carried = note.detail.value("load", Json{});
  }
}

Expected<void> BridgeSide::tick(Time now, Observer& observer) {
  if (const auto snapshot = observer.collect(now, std::exchange(forgotten_, {}))) take_in(*snapshot, now);

  const double belt_travel_m = first().state().belt_travel_m;
  std::vector<ObjectBelief> objects = predicted(seen_.objects, now, belt_travel_m);
  for (const auto& robot : robots_) {
    if (robot->skills.label) robot->skills.label(objects);
  }
  std::vector<ObjectBelief> obstacles = objects;
  std::ranges::copy(predicted(seen_.cut, now, belt_travel_m), std::back_inserter(obstacles));
  for (const auto& robot : robots_) robot->skills.refresh(now, obstacles, seen_.belt_seen);
  for (const auto& robot : robots_) {
    if (robot->skills.unseen) std::ranges::copy(robot->skills.unseen(), std::back_inserter(objects));
  }
  for (const auto& robot : robots_) {
    if (auto good = robot->arming.tick(now); !good) return good;
  }
  look_after_parts(now);
  const bool belt_waits = !stopping_ && ask_brain(objects, now);
  // What nobody sees must not ride by unread, nor into the arm.
  const bool blind = observer.watches_belt() && now - seen_.belt_clear > kBlind;
  tell_belt(belt_waits || blind, now);
  if (visitors_) visitors_(now);

  bridge_.tick(now);
  if (bridge_.fault()) return std::unexpected(*bridge_.fault());
  for (const auto& robot : robots_) {
    if (!bridge_.uses_resources(robot->skills.robot) && !robot->arming.settles()) {
      // It would hide what the belt waits for to be seen.
      const bool parks = (vitals_.belt_unseen() || falls_back_ || belt_waits) && robot->skills.park;
      parks ? robot->skills.park(now) : robot->skills.rest(now);
    }
    if (auto noted = note_carried(*robot, now); !noted) return noted;
  }
  for (const bridge::OutcomeReport& report : bridge_.take_outcomes()) {
    asked_.erase(report.id);
    if (brain_.heard(report.id, report.outcome)) last_outcome_ = now;
  }
  for (const auto& robot : robots_) {
    for (const std::uint32_t track : robot->skills.take_forgotten()) {
      gone_.push_back(track);
      forgotten_.push_back(track);
    }
    if (!robot->skills.take_strays) continue;
    const std::vector<Json> strays = robot->skills.take_strays();
    for (const Json& stray : strays) bridge_.note("stray", stray, now, task::text_of(stray, "code"));
    // Durable at once: a bridge that comes after this one could not tell.
    if (!strays.empty()) (void)bridge_.commit(now);
  }
  if (gone_.size() > kGoneRemembered) gone_.erase(gone_.begin(), gone_.end() - kGoneRemembered);
  return {};
}

void BridgeSide::take_in(const Snapshot& snapshot, Time now) {
  for (const auto& [place, count] : snapshot.occupancy) {
    const auto seen = seen_.occupancy.find(place);
    const int before = seen == seen_.occupancy.end() ? 0 : seen->second;
    if (count > before) bridge_.note("fell", {{"place", place}, {"things", count}, {"before", before}}, now);
  }
  seen_ = snapshot;
  seen_behind_ = now - snapshot.due;
  if (snapshot.base && first().locate) first().locate(*snapshot.base);
}

// One that will go on by itself is waited for; one that waits for a person may be passed, if there is room.
bool BridgeSide::stands_in_the_way(const Robot& robot) const {
  if (robot.arming.settles()) return true;
  if (robot.operational() && !robot.arming.needs_person()) return false;
  return !robot.arming.needs_person() || !robot.skills.lets_pass();
}

// What stands beside an arm that is being brought out must not be pushed against it. Of itself each arm sees to that
// the belt stands while it is not operational.
void BridgeSide::tell_belt(bool waits, Time now) {
  for (const auto& robot : robots_) {
    waits = waits || robot->arming.settles() || robot->skills.holds_belt(now);
  }
  for (const auto& robot : robots_) {
    const bool blocked =
        std::ranges::any_of(robots_, [&](const auto& other) { return other != robot && stands_in_the_way(*other); });
    robot->skills.belt(waits || blocked ? link::Belt::kWaits : link::Belt::kRuns);
  }
}

std::vector<Arming*> BridgeSide::armings() {
  std::vector<Arming*> armings;
  for (const auto& robot : robots_) armings.push_back(&robot->arming);
  return armings;
}

bool BridgeSide::waits_for_person() const {
  return std::ranges::all_of(robots_, [](const auto& robot) { return robot->arming.needs_person(); });
}

std::int64_t BridgeSide::stops() const {
  std::int64_t stops = 0;
  for (const auto& robot : robots_) stops += robot->arming.stops();
  return stops;
}

std::int64_t BridgeSide::interventions() const {
  std::int64_t interventions = 0;
  for (const auto& robot : robots_) interventions += robot->arming.interventions();
  return interventions;
}

BridgeSide::Account BridgeSide::account() const {
  Account account{.retries = retries()};
  for (const auto& robot : robots_)
    account.interventions.push_back({robot->arming.interventions(), robot->arming.needs_person()});
  for (const auto& [part, health] : health_.parts()) account.alerts[part] = health.alerts;
  return account;
}

void BridgeSide::begin_with(const Account& before, Time now) {
  retries_before_ = before.retries;
  for (std::size_t i = 0; i < robots_.size(); ++i) robots_[i]->arming.begin_with(before.interventions[i]);
  health_.begin_with(before.alerts, now);
}

void BridgeSide::look_after_parts(Time now) {
  vitals_.eyes(seen_, seen_behind_, now);
  for (const auto& robot : robots_) {
    const link::State& state = robot->skills.state();
    robot->vitals.arm(
        state, robot->arming.needs_person() ? RobotVitals::Resumes::kByPerson : RobotVitals::Resumes::kByItself, now);
    if (robot->skills.grip) robot->skills.grip(robot->vitals.vacuum(state, now));
    robot->vitals.loop(state, now);
  }
  // The belt stands as soon as one of them lets it stand.
  const auto stays = std::ranges::find_if(robots_, [](const auto& robot) {
    return !robot->operational() || robot->skills.state().belt != link::Belt::kRuns;
  });
  vitals_.belt((stays == robots_.end() ? robots_.front() : *stays)->skills.state(), now);
  vitals_.bridge(bridge_.open_count(), now);
  vitals_.journal(bridge_.journal(), now);
  hold_back();
}

void BridgeSide::hold_back() {
  // What is begun goes on. A new task would be one more that a camera has to show the way to.
  using enum bridge::Arbiter::Withheld;
  bridge_.withhold(resting_ ? kAll : vitals_.belt_unseen() ? kResources : kNothing);
  if (resting_) {
    bridge_.refuse_new(Error{"the robot rests, and takes no tasks", "run", "have it go on, and send them again"});
    return;
  }
  bridge_.refuse_new(vitals_.lacks_room().empty()
                         ? std::nullopt
                         : std::optional(Error{"no room for new tasks: " + vitals_.lacks_room(), "journal",
                                               "free some space; tasks are taken again by themselves"}));
}

std::vector<ObjectBelief> BridgeSide::predicted(const std::vector<ObjectBelief>& seen, Time now,
                                                double belt_travel_m) const {
  std::vector<ObjectBelief> objects;
  for (ObjectBelief object : seen) {
    if (std::find(gone_.begin(), gone_.end(), object.track) != gone_.end()) continue;
    object.world_from_top.translation().x() += belt_travel_m - seen_.belt_travel_m;
    object.velocity_m_s.x() = first().state().belt_speed_m_s;
    object.stamp = now;
    objects.push_back(std::move(object));
  }
  return objects;
}

// Where along the belt a robot that works takes hold last; nothing: none works.
std::optional<double> BridgeSide::taken_until_m() const {
  std::optional<double> until_m;
  for (const auto& robot : robots_) {
    if (robot->arming.needs_person()) continue;
    until_m = std::max(until_m.value_or(robot->skills.takes_until_m), robot->skills.takes_until_m);
  }
  return until_m;
}

bool BridgeSide::ask_brain(const std::vector<ObjectBelief>& objects, Time now) {
  // It is not its silence.
  if (resting_) {
    decided_ = brain_heard_ = now;
    vitals_.brain(brain_heard_, now);
    return true;
  }
  const bool stalled = stalls_ != nullptr && stalls_->on(now);
  // A brain that says nothing asks for nothing, nor is it asked for what there is no room for.
  std::optional<brain::Decisions> decisions;
  if (!stalled && vitals_.lacks_room().empty()) decisions = hear_brain(objects, now);
  if (!stalled && !(decisions && decisions->silent)) brain_heard_ = now;
  vitals_.brain(brain_heard_, now);
  if (!decisions) return fall_back(objects, now);
  submit_all(*decisions, objects, now);
  if (decisions->silent) return fall_back(objects, now);
  decided_ = now;
  if (std::exchange(falls_back_, false)) bridge_.note("fallback", {{"decides", "brain"}}, now);
  brain_holds_belt_ = decisions->belt_waits;
  return decisions->belt_waits;
}

brain::Decisions BridgeSide::hear_brain(const std::vector<ObjectBelief>& objects, Time now) {
  tell_brain_what_rode();
  if (const auto until_m = taken_until_m()) brain_.taken_until(*until_m);
  std::vector<ObjectBelief> undecided = objects;
  std::erase_if(undecided, [&](const ObjectBelief& object) { return rode(object); });
  return brain_.observe(undecided, now, bridge_.set_aside());
}

// A brain may send anything: not even that it is a task is sure.
void BridgeSide::submit_all(const brain::Decisions& decisions, const std::vector<ObjectBelief>& objects, Time now) {
  for (const Json& task : decisions.tasks) {
    note_seen(task::text_of(task, "order"), objects, now);
    const std::string text = task.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (auto admitted = bridge_.submit(text, now); !admitted) {
      const std::string code = brain::code_of(task);
      // Asked for again under another id, if it comes by.
      if (brain_.refused(task, admitted.error()))
        bridge_.note("ride", {{"code", code}, {"reason", "refused: " + admitted.error().line()}}, now, code);
    } else {
      if (admitted->accepted == bridge::Accepted::kNew) asked_.emplace(admitted->id, task::text_of(task, "order"));
      brain_.taken(task);
    }
  }
  for (const brain::Ride& ride : decisions.rides) {
    if (ride.code.empty()) ++unlabelled_;
    bridge_.note("ride", {{"track", ride.track}, {"code", ride.code}, {"reason", ride.reason}}, now, ride.code);
  }
}

// What is not decided on must not ride by meanwhile; or, by the world's rules, it does, and only what was asked for
// before gets its turn.
bool BridgeSide::fall_back(const std::vector<ObjectBelief>& objects, Time now) {
  const Duration undecided = now - decided_;
  const world::Fallback& fallback = world_.fallback;
  if (fallback.undecided == world::Fallback::Undecided::kHold || undecided <= from_s(fallback.after_s))
    return brain_holds_belt_ || undecided > kBrainSilent;
  if (!std::exchange(falls_back_, true)) bridge_.note("fallback", {{"decides", "rules"}}, now);
  world::Belt belt = world_.belt;
  belt.pick_x_max_m = taken_until_m().value_or(first().takes_until_m);
  bool waits = false;
  for (const ObjectBelief& object : objects) {
    // A visitor's task names no order, and what nobody has read is not its parcel.
    const bool asked = !object.code.empty() &&
                       std::ranges::any_of(asked_, [&](const auto& task) { return task.second == object.code; });
    const double x_m = object.world_from_top.translation().x();
    if (asked) {
      waits = waits || belt.must_wait_for(x_m, std::max(object.velocity_m_s.x(), 0.0));
    } else if (x_m > belt.pick_x_max_m) {
      let_ride(object, now);
    }
  }
  return waits;
}

void BridgeSide::let_ride(const ObjectBelief& object, Time now) {
  if (rode(object)) return;
  rode_tracks_.push_back(object.track);
  if (rode_tracks_.size() > kGoneRemembered) rode_tracks_.erase(rode_tracks_.begin());
  const char* const reason = vitals_.lacks_room().empty() ? "the brain was silent" : "no room for tasks";
  for (const std::string& code : object.disputed.empty() ? std::vector{object.code} : object.disputed) {
    rode_.push_back(code);
    bridge_.note("ride", {{"track", object.track}, {"code", code}, {"reason", reason}}, now, code);
  }
}

// What the brain decided on.
void BridgeSide::note_seen(const std::string& code, const std::vector<ObjectBelief>& objects, Time now) {
  const auto object = std::ranges::find(objects, code, &ObjectBelief::code);
  if (code.empty() || object == objects.end()) return;
  const auto x_axis = object->world_from_top.linear().col(0);
  bridge_.note(bridge::kSeenEvent,
               {{"track", object->track},
                {"position_m", task::list_of(object->world_from_top.translation())},
                {"yaw_rad", std::atan2(x_axis.y(), x_axis.x())},
                {"size_m", task::list_of(object->size_m)},
                {"sigma_m", object->position_sigma_m},
                {"frames", object->frames_seen},
                {"seen_s", object->last_seen.s()}},
               now, code);
}

// Durable at once: a bridge that comes after this one must know what hangs there.
Expected<void> BridgeSide::note_carried(Robot& robot, Time now) {
  const Json& carries = robot.skills.carries();
  bridge_.load(carries.is_object() && !carries.value("gone", false), robot.skills.robot);
  if (carries == robot.carried) return {};
  const std::string code = task::text_of(carries.is_object() ? carries : robot.carried, "code");
  robot.carried = carries;
  bridge_.note(bridge::kCarriesEvent, {{"robot", robot.skills.name}, {"load", robot.carried}}, now, code);
  return bridge_.commit(now);
}

void BridgeSide::stop(Time now, const std::string& reason) {
  if (stopping_) return;
  stopping_ = true;
  bridge_.note("shutdown", {{"reason", reason}}, now);
  bridge_.stop(now, reason);
}

// Durable at once, as go_on() is: a bridge that comes after this one keeps to it. What cannot be written shows in the
// bridge's next tick.
void BridgeSide::rest(Time now) {
  const bool is_news = !std::exchange(resting_, true);
  hold_back();  // else the tick that comes yet would begin what is granted in it
  if (is_news) bridge_.note("rest", {{"rests", true}}, now);
  const bool paused = bridge_.pause_all(now, kToRest);
  if (is_news || paused) (void)bridge_.commit(now);
}

void BridgeSide::go_on(Time now) {
  if (!std::exchange(resting_, false)) return;
  hold_back();
  bridge_.note("rest", {{"rests", false}}, now);
  bridge_.resume_all(now, kToRest);
  (void)bridge_.commit(now);
}

bool BridgeSide::rests() const { return resting_ && bridge_.all_paused(); }

bool BridgeSide::idle() const { return bridge_.idle() && (stopping_ || !brain_.waits()); }

bool BridgeSide::rode(const ObjectBelief& object) const {
  return std::ranges::find(rode_tracks_, object.track) != rode_tracks_.end();
}

void BridgeSide::tell_brain_what_rode() {
  for (const std::string& code : std::exchange(rode_, {})) brain_.recall_ride(code);
}

void BridgeSide::close(Time now) {
  tell_brain_what_rode();
  const std::vector<std::string> unseen = brain_.unseen();
  for (const std::string& code : unseen) {
    bridge_.note("ride",
                 {{"code", code},
                  {"reason", stopping_ ? "not seen before the run was stopped" : "never identified"},
                  {"seen", false}},
                 now, code);
  }
  bridge_.note("closed",
               {{"never_identified", unseen.size()}, {"unlabelled_rides", unlabelled_}, {"refused", bridge_.refused()}},
               now);
}

}  // namespace pons::runner
