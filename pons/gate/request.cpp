#include "pons/gate/request.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pons/task/json_text.hpp"
#include "pons/task/schema.hpp"

namespace pons::gate {
namespace {

using task::Json;
using task::Schema;

constexpr std::string_view kSchema = R"({
  "type": "object", "required": ["op"], "additionalProperties": false,
  "properties": {
    "op": {"enum": ["submit", "list", "show", "history", "watch", "pause", "resume", "cancel", "halt", "approve",
                    "observe", "chunk", "health", "axes", "servo", "base", "drive", "robot", "stop", "emergency_stop", "reset", "arm", "rest",
                    "go_on", "end"]},
    "task": {"type": "object"},
    "tasks": {"type": "array", "items": {"type": "object"}},
    "which": {"enum": ["open", "ended"]},
    "limit": {"type": "integer", "minimum": 1, "maximum": 1000},
    "id": {"type": "string", "minLength": 1, "maxLength": 64},
    "after": {"type": "integer", "minimum": 0, "maximum": 1000000000000},
    "reason": {"type": "string", "maxLength": 200},
    "tier": {"type": "string", "minLength": 1, "maxLength": 64},
    "by": {"type": "string", "minLength": 1, "maxLength": 64},
    "stream": {"type": "integer", "minimum": 0, "maximum": 1000000000},
    "observed": {"type": "number", "minimum": 0, "maximum": 1000000000},
    "period_ms": {"type": "number", "minimum": 0, "maximum": 1000000},
    "actions": {"type": "array", "items": {"type": "array", "items": {"type": "number"}}},
    "last": {"type": "boolean"},
    "positions": {"type": "array", "items": {"type": "number"}, "minItems": 1, "maxItems": 8},
    "ahead_m_s": {"type": "number", "minimum": -100, "maximum": 100},
    "turn_rad_s": {"type": "number", "minimum": -100, "maximum": 100}
  }
})";

// Those with nothing beside their name.
const std::map<std::string, Operation, std::less<>> kBare = {
    {"observe", Operation::kObserve}, {"health", Operation::kHealth}, {"robot", Operation::kRobot},
    {"stop", Operation::kStop},       {"reset", Operation::kReset},   {"emergency_stop", Operation::kEmergencyStop},
    {"arm", Operation::kArm},         {"rest", Operation::kRest},     {"go_on", Operation::kGoOn},
    {"end", Operation::kEnd},         {"base", Operation::kBase},     {"axes", Operation::kAxes},
};

const Schema& schema() {
  static const Schema compiled = Schema::compile(Json::parse(kSchema)).value();
  return compiled;
}

// Those of one task.
const std::map<std::string, Operation, std::less<>> kOfTask = {
    {"show", Operation::kShow},   {"history", Operation::kHistory}, {"watch", Operation::kWatch},
    {"pause", Operation::kPause}, {"resume", Operation::kResume},   {"cancel", Operation::kCancel},
    {"halt", Operation::kHalt},   {"approve", Operation::kApprove}};

// Which operations each member belongs to; all but kOptional are needed there.
const std::map<std::string_view, std::vector<std::string_view>> kMembers = {
    {"task", {"submit"}},
    {"tasks", {"submit"}},
    {"tier", {"approve"}},
    {"by", {"approve"}},
    {"id", {"show", "history", "watch", "pause", "resume", "cancel", "halt", "approve"}},
    {"after", {"list", "watch"}},
    {"which", {"list"}},
    {"limit", {"list"}},
    {"reason", {"pause", "cancel", "halt"}},
    {"stream", {"chunk"}},
    {"observed", {"chunk"}},
    {"period_ms", {"chunk"}},
    {"actions", {"chunk"}},
    {"last", {"chunk"}},
    {"positions", {"servo"}},
    {"ahead_m_s", {"drive"}},
    {"turn_rad_s", {"drive"}}};
constexpr std::array<std::string_view, 7> kOptional = {"task", "tasks", "after", "which", "limit", "reason", "last"};

Expected<void> check_members(const Json& json, std::string_view operation) {
  for (const auto& [member, belongs_to] : kMembers) {
    const bool belongs = std::ranges::find(belongs_to, operation) != belongs_to.end();
    const bool all_tasks = member == "id" && operation == "watch";
    const bool needed = belongs && !all_tasks && std::ranges::find(kOptional, member) == kOptional.end();
    if (json.contains(member) ? belongs : !needed) continue;
    if (needed) return fail(fmt::format("'{}' is missing", member), fmt::format("/{}", member), "add it");
    return fail(fmt::format("'{}' does not belong there", member), fmt::format("/{}", member),
                fmt::format("give it with {}, only", fmt::join(belongs_to, " or ")));
  }
  return {};
}

Expected<Asked> submitted(const Json& json) {
  const auto task = json.find("task"), tasks = json.find("tasks");
  if ((task == json.end()) == (tasks == json.end()))
    return fail("submit needs 'task' or 'tasks', and not both", "/task", "give one task, or a reply's list of them");
  const bool one = task != json.end();
  return Asked{.operation = Operation::kSubmit, .task = one ? task->dump() : Json{{"tasks", *tasks}}.dump()};
}

Expected<Asked> chunk_from(const Json& json) {
  Asked asked{.operation = Operation::kChunk, .stream = json.at("stream").get<std::uint64_t>()};
  asked.chunk.observed = json.at("observed").get<double>();
  asked.chunk.period = from_s(1e-3 * json.at("period_ms").get<double>());
  asked.chunk.last = json.value("last", false);
  for (const Json& values : json.at("actions")) {
    if (values.size() > kMaxAxes)
      return fail(fmt::format("action {} has {} axes", asked.chunk.actions.size(), values.size()), "chunk_size",
                  "give one value an axis of the robot");
    AxisVector& action = asked.chunk.actions.emplace_back(static_cast<Eigen::Index>(values.size()));
    for (std::size_t axis = 0; axis < values.size(); ++axis)
      action[static_cast<Eigen::Index>(axis)] = values[axis].get<double>();
  }
  return asked;
}

}  // namespace

Expected<Asked> asked_from(std::string_view text) {
  const auto json = task::parse_json(text);
  if (!json) return std::unexpected(json.error());
  if (auto fits = schema().check(*json); !fits) return std::unexpected(fits.error());
  const auto operation = json->at("op").get<std::string>();
  if (auto good = check_members(*json, operation); !good) return std::unexpected(good.error());
  if (operation == "submit") return submitted(*json);
  if (const auto of_task = kOfTask.find(operation); of_task != kOfTask.end()) {
    return Asked{.operation = of_task->second,
                 .task = json->value("id", std::string{}),
                 .reason = json->value("reason", std::string{}),
                 .tier = json->value("tier", std::string{}),
                 .by = json->value("by", std::string{}),
                 .after = json->value("after", std::int64_t{0})};
  }
  if (operation == "list") {
    return Asked{.operation = Operation::kList,
                 .after = json->value("after", std::int64_t{0}),
                 .which = json->value("which", "open") == "open" ? Which::kOpen : Which::kEnded,
                 .limit = json->value("limit", kListed)};
  }
  if (operation == "chunk") return chunk_from(*json);
  if (operation == "servo") {
    Asked asked{.operation = Operation::kServo};
    const auto positions = json->at("positions").get<std::vector<double>>();
    static_assert(kMaxAxes == 8, "as the schema has it");
    asked.positions = AxisVector::Map(positions.data(), static_cast<Eigen::Index>(positions.size()));
    return asked;
  }
  if (operation == "drive") {
    return Asked{.operation = Operation::kDrive,
                 .ahead_m_s = json->at("ahead_m_s").get<double>(),
                 .turn_rad_s = json->at("turn_rad_s").get<double>()};
  }
  return Asked{.operation = kBare.at(operation)};
}

bool asks_to_stop(std::string_view text) {
  constexpr std::size_t kLongest = 256;  // of what is looked at: a stop has nothing beside its name
  if (text.size() > kLongest) return false;
  const auto asked = asked_from(text);
  return asked && (asked->operation == Operation::kStop || asked->operation == Operation::kEmergencyStop);
}

std::optional<std::string> submission_in(std::string_view text) {
  constexpr std::array<std::string_view, 5> kPlaces = {"/op", "/id", "/task", "/tasks", "/task/id"};
  const auto seen = task::glimpse(text, kPlaces);
  const auto operation = seen.find("/op");
  const bool brings = seen.contains("/task") || seen.contains("/tasks");
  if (operation != seen.end() && operation->second != "submit" && !brings) return std::nullopt;
  // A task that was sent without the request round it has its own.
  const auto id = seen.find(operation == seen.end() && !brings ? "/id" : "/task/id");
  return id != seen.end() && task::is_id(id->second) ? id->second : std::string{};
}

Json refusal(const Error& error) { return {{"ok", false}, {"error", error.line()}}; }

}  // namespace pons::gate
