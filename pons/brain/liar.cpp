#include "pons/brain/liar.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pons/task/json_value.hpp"

namespace pons::brain {
namespace {

constexpr std::size_t kRemembered = 16;
constexpr int kDeep = 1000, kUrgent = 100, kMovesAtOnce = 4;
constexpr std::size_t kLong = 100'000;
constexpr double kNever_s = 1e7;  // longer than any run
constexpr std::string_view kNobody = "NOBODY";

Json step(const char* skill, Json arguments) { return {{"skill", skill}, {"arguments", std::move(arguments)}}; }

Json task_of(const std::string& id, const std::string& order, std::initializer_list<Json> steps) {
  Json task{{"id", id}, {"steps", Json::array()}};
  if (!order.empty()) task["order"] = order;
  for (const Json& one : steps) task["steps"].push_back(one);
  return task;
}

Json sorting(const std::string& id, const std::string& code, const std::string& place) {
  return task_of(id, code, {step("pick", {{"object", code}}), step("place", {{"place", place}, {"object", code}})});
}

Json move(const std::string& id, const std::string& place) {
  return task_of(id, {}, {step("move_to", {{"place", place}})});
}

Json home(const std::string& id) { return move(id, "home"); }

Json urgent(Json task) {
  task["priority"] = kUrgent;
  return task;
}

Json nested(int levels) {
  Json all = Json::array();
  for (int i = 0; i < levels; ++i) {
    Json outer = Json::array();
    outer.push_back(std::move(all));
    all = std::move(outer);
  }
  return all;
}

}  // namespace

Lies::Lies(const world::FaultRate& rate, const Random& random) : an_hour_(rate.often), random_(random) { wait({}); }

void Lies::wait(Time after) {
  next_ = after + from_s(std::min(kNever_s, -std::log(1 - random_.uniform()) * 3600 / an_hour_));
}

std::optional<Lie> Lies::due(Time now) {
  if (!(an_hour_ > 0) || now < next_) return std::nullopt;
  wait(now);
  ++count_;
  if (left_.empty()) {
    for (std::size_t i = 0; i < kLies; ++i) left_.push_back(static_cast<Lie>(i));
  }
  const auto drawn = left_.begin() + static_cast<std::ptrdiff_t>(random_.below(left_.size()));
  const Lie lie = *drawn;
  left_.erase(drawn);
  return lie;
}

Decisions Liar::observe(const std::vector<ObjectBelief>& beliefs, Time now, const std::set<std::string>& set_aside) {
  Decisions decisions = honest_.observe(beliefs, now, set_aside);
  for (const Json& task : decisions.tasks) {
    const Json& last = task.at("steps").back().at("arguments");
    open_.push_back({task::text_of(task, "id"), code_of(task), task::text_of(last, "place")});
  }
  if (open_.size() > kRemembered) open_.erase(open_.begin(), open_.end() - kRemembered);
  const auto lie = lies_.due(now);
  if (!lie) return decisions;
  for (Json& task : tell(*lie, beliefs)) {
    told_.push_back(task);
    decisions.tasks.push_back(std::move(task));
  }
  return decisions;
}

std::vector<Json> Liar::tell(Lie lie, const std::vector<ObjectBelief>& beliefs) {
  const std::string id = lies_.new_id();
  const Subject of = asked();
  switch (lie) {
    case Lie::kUnknownSkill:
      return {task_of(id, of.code, {step("teleport", {{"object", of.code}})})};
    case Lie::kWrongType:
      return {task_of(id, of.code, {step("pick", {{"object", 17}})})};
    case Lie::kUnknownObject:
      return {urgent(task_of(id, {}, {step("pick", {{"object", kNobody}})}))};
    case Lie::kUnknownPlace:
      return {sorting(id, of.code, "nowhere")};
    case Lie::kElsewhere:
      return {sorting(id, of.code, another_chute(of.place))};
    case Lie::kContradiction:
      return {sorting(id, of.code, of.place), sorting(lies_.new_id(), of.code, another_chute(of.place))};
    case Lie::kTakenId:
      return {home(of.id)};
    case Lie::kForestalledId: {
      // One that lies there and was not asked for yet; its first task bears its code.
      const auto next = std::ranges::find_if(beliefs, [&](const ObjectBelief& object) {
        return !object.code.empty() && std::ranges::find(open_, object.code, &Subject::code) == open_.end() &&
               std::ranges::find(ended_, object.code, &Subject::code) == ended_.end();
      });
      return {home(next == beliefs.end() ? of.code + ".2" : next->code)};
    }
    case Lie::kPriority: {
      Json task = sorting(id, of.code, of.place);
      task["priority"] = 1'000'000'000;
      return {std::move(task)};
    }
    case Lie::kDeadline: {
      Json task = sorting(id, of.code, of.place);
      task["deadline_s"] = 1e-3;
      return {std::move(task)};
    }
    case Lie::kTooDeep:
      return {task_of(id, of.code, {step("pick", {{"object", nested(kDeep)}})})};
    case Lie::kTooLong:
      return {task_of(id, of.code, {step("pick", {{"object", std::string(kLong, 'x')}})})};
    case Lie::kSortedAlready: {
      const Subject& done = ended_.empty() ? of : ended_.back();
      return {urgent(sorting(id, done.code, done.place))};
    }
    case Lie::kPickOnly: {
      const auto there = std::ranges::find_if(beliefs, [](const ObjectBelief& object) { return !object.code.empty(); });
      const std::string code = there == beliefs.end() ? of.code : there->code;
      return {urgent(task_of(id, code, {step("pick", {{"object", code}})}))};
    }
    case Lie::kPlaceOnly:
      return {urgent(task_of(id, of.code, {step("place", {{"place", of.place}, {"object", of.code}})}))};
    case Lie::kPutAway:
      return {urgent(sorting(id, of.code, exception()))};
    case Lie::kTwice:
      return {urgent(sorting(id, of.code, of.place))};
    case Lie::kMoves: {
      std::vector<Json> moves;
      for (int i = 0; i < kMovesAtOnce; ++i)
        moves.push_back(urgent(move(lies_.new_id(), i % 2 == 0 ? of.place : "home")));
      return moves;
    }
    case Lie::kNoTask:
      return {Json::array({"task", 1, nullptr})};
    case Lie::kBadId:
      return {Json{{"id", 5}, {"order", 6}, {"steps", 7}}};
    case Lie::kBadText:
      return {home(id + "\xff\xfe")};
  }
  return {};
}

Liar::Subject Liar::asked() const {
  if (!open_.empty()) return open_.back();
  if (!ended_.empty()) return ended_.back();
  return {std::string(kNobody), std::string(kNobody), another_chute({})};
}

std::string Liar::another_chute(const std::string& than) const {
  for (const world::Place& place : world_.arms().front().places) {
    if (place.kind == world::PlaceKind::kChute && place.name != than) return place.name;
  }
  return than;
}

std::string Liar::exception() const {
  const auto found = std::ranges::find(world_.places, world::PlaceKind::kException, &world::Place::kind);
  return found == world_.places.end() ? "exception" : found->name;
}

bool Liar::is_lie(const Json& task) {
  const auto told = std::ranges::find(told_, task);
  if (told == told_.end()) return false;
  told_.erase(told);
  return true;
}

void Liar::taken(const Json& task) {
  if (!is_lie(task)) return honest_.taken(task);
  taken_.insert(task::text_of(task, "id"));
}

bool Liar::refused(const Json& task, const Error& why) { return !is_lie(task) && honest_.refused(task, why); }

bool Liar::heard(std::string_view id, task::Outcome outcome) {
  if (const auto lie = taken_.find(id); lie != taken_.end()) {
    taken_.erase(lie);
    return false;
  }
  if (const auto ended = std::ranges::find(open_, id, &Subject::id); ended != open_.end()) {
    if (outcome == task::Outcome::kSucceeded) ended_.push_back(*ended);
    if (ended_.size() > kRemembered) ended_.pop_front();
    open_.erase(ended);
  }
  return honest_.heard(id, outcome);
}

// What is no work of the honest one's it passes over.
void Liar::recall(const task::Task& task, std::optional<task::Outcome> outcome) { honest_.recall(task, outcome); }

}  // namespace pons::brain
