#include "tests/system/referee.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>

#include "pons/bridge/journal/story.hpp"
#include "pons/cerebellum/safety_machine.hpp"

namespace pons::tests {
namespace {

using bridge::TaskHistory;
using link::SafetyState;
using task::Outcome;

// The loop stops an arm that hears nothing for 100 ms, and stopping takes as long as its limits make it.
constexpr Duration kStopsWithin = std::chrono::milliseconds(900);

// What the journal says that a task has begun, by skill and arguments; of one whose events were compacted away, all
// that it may have.
struct Attempt {
  std::string skill;
  Json arguments;
};

// The one that a sender's tree may have.
std::optional<Attempt> place_in(const std::string& xml) {
  static const std::regex leaf(R"re(<place place="([^"]*)" object="([^"]*)"/>)re");
  std::smatch found;
  if (!std::regex_search(xml, found, leaf)) return std::nullopt;
  return Attempt{"place", {{"place", found[1].str()}, {"object", found[2].str()}}};
}

std::vector<Attempt> attempts(const TaskHistory& task, Kept kept) {
  std::vector<Attempt> found;
  if (kept == Kept::kEnds && task.events.empty()) {
    for (const task::Step& step : task.record.task.steps) found.push_back({step.skill, step.arguments});
    if (task.record.task.tree) {
      const auto place = place_in(task.record.task.tree->xml);
      if (place) found.push_back(*place);
    }
  }
  for (const bridge::Event& event : task.events) {
    if (event.kind != bridge::kAttemptEvent) continue;
    const auto step = event.detail.value("step", std::size_t{0});
    const bool is_step = step < task.record.task.steps.size();
    found.push_back({event.detail.value("skill", std::string{}),
                     is_step ? task.record.task.steps[step].arguments : event.detail.value("arguments", Json{})});
  }
  return found;
}

bool left_out(const TaskHistory& task) {
  return std::ranges::any_of(task.events, [](const auto& event) { return event.kind == bridge::kLeftOutEvent; });
}

std::string_view outcome_of(const TaskHistory& task) {
  return task.record.outcome ? task::name(task.record.outcome->outcome) : "open";
}

}  // namespace

void Referee::accepted(const std::string& id, const Json& task) {
  const auto [known, is_new] = accepted_.emplace(id, task);
  if (!is_new && known->second != task) wrong_(fmt::format("{} was accepted with two contents", id));
}

void Referee::ended(const std::string& id, Outcome outcome) {
  const auto [known, is_new] = ended_.emplace(id, outcome);
  if (!is_new && known->second != outcome)
    wrong_(fmt::format("{} was told to have {} and to have {}", id, task::name(known->second), task::name(outcome)));
}

bool Referee::all_heard() const {
  return std::ranges::all_of(accepted_, [&](const auto& entry) { return ended_.contains(entry.first); });
}

void Referee::watch(const Glance& glance) {
  const SafetyState state = glance.loop.safety;
  const bool is_emergency = cerebellum::is_emergency(state);
  if (is_emergency && !cerebellum::is_emergency(before_)) {
    emergency_at_ = glance.now;
    needs_person_ = true;
  }
  // In one period the loop steps first: what the bridge hears in that of a stop it hears after it.
  if (cerebellum::is_emergency(before_) && !is_emergency && !(reset_at_ && *reset_at_ >= emergency_at_))
    wrong_("the arm has left an emergency stop that nobody has reset");
  if (needs_person_ && cerebellum::moves(state)) {
    if (!(armed_at_ && *armed_at_ > emergency_at_)) wrong_("the arm was armed after an emergency stop, and by nobody");
    needs_person_ = false;
  }
  if (stopped_at_ && cerebellum::moves(state) && !cerebellum::moves(before_)) {
    if (!(armed_at_ && *armed_at_ > *stopped_at_))
      wrong_("a person has stopped the arm, and nobody has armed it since");
    stopped_at_.reset();
  }
  const bool may_move = cerebellum::moves(state) || cerebellum::is_braking(state) || cerebellum::moves(before_) ||
                        cerebellum::is_braking(before_);
  if (glance.plant.moves() && !may_move) wrong_(fmt::format("the arm moves in the state {}", link::name(state)));
  if (glance.plant.moves() && glance.bridge_gone && glance.now - *glance.bridge_gone > kStopsWithin)
    wrong_(fmt::format("the arm moves {:.1f} s after its bridge died", to_s(glance.now - *glance.bridge_gone)));
  before_ = state;
}

void Referee::takes_up(const std::string& known, const std::string& knows, const Plant& plant) {
  const Parcel* const hangs = plant.on_cups();
  if (hangs != nullptr && hangs->code == known && knows != known)
    wrong_(fmt::format("{} hangs on the cups as the bridge before knew; this one knows of {}", known,
                       knows.empty() ? "nothing" : knows));
}

void Referee::look(const bridge::Journal& journal) {
  for (const std::string& line : bridge::audit(journal)) wrong_("the journal: " + line);
  check_told(journal);
  check_endings(journal);
}

// What was told to end begins nothing more; and where the bridge that was told so is gone, it is cancelled.
void Referee::check_endings(const bridge::Journal& journal) {
  std::string id;
  std::optional<std::int64_t> told_in;  // a run
  const auto read = journal.each_event([&](const bridge::Event& event) -> Expected<void> {
    if (event.task != id) told_in.reset();
    id = event.task;
    if (event.kind == bridge::kCancellingEvent || event.kind == bridge::kHaltingEvent) told_in = event.run;
    if (told_in && event.kind == bridge::kAttemptEvent)
      wrong_(fmt::format("{} has begun a skill after it was told to end", id));
    if (told_in && event.kind == bridge::kEndedEvent && event.run > *told_in &&
        event.detail.value("outcome", "") != task::name(Outcome::kCancelled))
      wrong_(fmt::format("{} was told to end, and the next bridge has not ended it so", id));
    return {};
  });
  if (!read) wrong_("the journal: " + read.error().line());
}

void Referee::check_told(const bridge::Journal& journal) {
  for (const auto& [id, content] : accepted_) {
    const auto held = journal.record(id);
    if (!held || !*held) {
      wrong_(fmt::format("{} was accepted and is lost", id));
    } else if (task::to_json((*held)->task) != content) {
      wrong_(fmt::format("{} was accepted, and the journal has another task under it", id));
    }
  }
  for (const auto& [id, outcome] : ended_) {
    const auto held = journal.record(id);
    const bool same = held && *held && (*held)->outcome && (*held)->outcome->outcome == outcome;
    if (!same) wrong_(fmt::format("{} was told to have {}, and the journal says otherwise", id, task::name(outcome)));
  }
}

void Referee::close(const bridge::Journal& journal, const Plant& plant) {
  look(journal);
  const auto notes = journal.notes();
  if (!notes) return wrong_("the journal: " + notes.error().line());
  const auto compacted = [](const auto& note) { return note.kind == bridge::kCompactedEvent; };
  kept_ = std::ranges::any_of(*notes, compacted) ? Kept::kEnds : Kept::kAll;
  const auto records = journal.tasks();
  if (!records) return wrong_("the journal: " + records.error().line());
  std::vector<TaskHistory> tasks;
  for (const bridge::TaskRecord& record : *records) {
    auto task = journal.task(record.task.id);
    if (!task || !*task) return wrong_(fmt::format("{} cannot be read", record.task.id));
    check_story(**task);
    tasks.push_back(std::move(**task));
  }
  check_parcels(tasks, plant);
  check_prints(tasks, plant);
}

void Referee::check_story(const TaskHistory& task) {
  const std::string& id = task.record.task.id;
  if (!task.record.outcome) return wrong_(fmt::format("{} has no outcome", id));
  const bool ending = std::ranges::any_of(task.events, [](const bridge::Event& event) {
    return event.kind == bridge::kCancellingEvent || event.kind == bridge::kHaltingEvent;
  });
  if (told_to_end_.contains(id) && task.record.outcome->outcome != Outcome::kCancelled && !ending &&
      kept_ == Kept::kAll)
    wrong_(fmt::format("{} was told to end, and the journal knows nothing of it", id));
}

void Referee::check_parcels(const std::vector<TaskHistory>& tasks, const Plant& plant) {
  for (const auto& [code, parcel] : plant.parcels()) {
    if (parcel.where != Parcel::Where::kPlace) {
      wrong_(fmt::format("parcel {} is still on {}", code,
                         parcel.where == Parcel::Where::kBelt ? "the belt" : "the cups"));
      continue;
    }
    bool brought = false, asked_there = false, broken_off = false;
    for (const TaskHistory& task : tasks) {
      for (const Attempt& attempt : attempts(task, kept_)) {
        if (attempt.skill != "place" || attempt.arguments.value("object", "") != code) continue;
        const bool there = attempt.arguments.value("place", "") == parcel.place;
        asked_there = asked_there || there;
        brought = brought || (there && task.record.outcome->outcome == Outcome::kSucceeded);
        broken_off = broken_off || task.record.outcome->outcome == Outcome::kCancelled;
        if (!there && task.record.outcome->outcome == Outcome::kSucceeded)
          wrong_(fmt::format("{} says that {} is in {}; it is in {}", task.record.task.id, code,
                             attempt.arguments.value("place", ""), parcel.place));
      }
    }
    const bool in_chute = parcel.place.starts_with("chute");
    if (parcel.place == "tray" && !parcel.was_lost) wrong_(fmt::format("{} was let go of beside the chutes", code));
    if (in_chute && !asked_there && !parcel.was_lost)
      wrong_(fmt::format("{} is in {}, and no task has brought it there", code, parcel.place));
    if (in_chute && !brought && !broken_off && !parcel.was_lost)
      wrong_(fmt::format("{} is in {} as it was asked for, and no task says so", code, parcel.place));
    if (parcel.taken != parcel.left)
      wrong_(fmt::format("{} was taken {} times and left {}", code, parcel.taken, parcel.left));
  }
}

void Referee::check_prints(const std::vector<TaskHistory>& tasks, const Plant& plant) {
  std::map<std::string, const TaskHistory*> by_id;
  for (const TaskHistory& task : tasks) by_id.emplace(task.record.task.id, &task);
  for (const auto& [job, times] : plant.prints()) {
    const auto& [id, number] = job;
    if (times > 1) wrong_(fmt::format("job {} of {} was printed {} times", number, id, times));
    const auto found = by_id.find(id);
    if (found == by_id.end()) {
      wrong_(fmt::format("job {} of {} was printed, and the journal knows no such task", number, id));
      continue;
    }
    const TaskHistory& task = *found->second;
    const bool told = std::ranges::any_of(attempts(task, kept_), [&](const Attempt& attempt) {
      return attempt.skill == "print" && attempt.arguments.value("number", -1) == job.second;
    });
    if (!told && !left_out(task) && !(kept_ == Kept::kEnds && task.events.empty()))
      wrong_(fmt::format("job {} of {} was printed, and the journal knows nothing of it", number, id));
  }
  for (const TaskHistory& task : tasks) {
    if (task.record.outcome->outcome != Outcome::kSucceeded) continue;
    for (const task::Step& step : task.record.task.steps) {
      if (step.skill != "print") continue;
      const int number = step.arguments.at("number").get<int>();
      if (plant.printed(step.arguments.at("task").get<std::string>(), number) != 1)
        wrong_(fmt::format("{} has {}, and job {} was not printed", task.record.task.id, outcome_of(task), number));
    }
  }
}

}  // namespace pons::tests
