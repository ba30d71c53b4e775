#include "pons/task/task.hpp"

#include <fmt/format.h>

#include <array>
#include <cassert>
#include <chrono>
#include <cmath>
#include <utility>

#include "pons/task/json_text.hpp"
#include "pons/task/schema.hpp"
#include "pons/task/task_schema.hpp"

namespace pons::task {
namespace {

constexpr std::array kNames{std::pair{Outcome::kSucceeded, std::string_view("SUCCEEDED")},
                            std::pair{Outcome::kFailed, std::string_view("FAILED")},
                            std::pair{Outcome::kCancelled, std::string_view("CANCELLED")},
                            std::pair{Outcome::kException, std::string_view("EXCEPTION")}};

// A deadline in seconds, kept to the microsecond. With nanoseconds the double would have no digit to spare after 52
// days and its way through the journal could move it.
using Microseconds = std::chrono::microseconds;

Time deadline_from(double seconds) { return Time(Microseconds(std::llround(seconds * 1e6))); }

double seconds_of(Time deadline) {
  return static_cast<double>(std::chrono::round<Microseconds>(deadline.since_start()).count()) / 1e6;
}

const Schema& task_schema() {
  static const Schema schema = Schema::compile(Json::parse(kTaskSchema)).value();
  return schema;
}

}  // namespace

std::string_view name(Outcome outcome) {
  for (const auto& [value, text] : kNames) {
    if (value == outcome) return text;
  }
  assert(false);
  return "UNKNOWN";
}

Expected<Outcome> outcome_from(std::string_view name) {
  for (const auto& [value, text] : kNames) {
    if (text == name) return value;
  }
  return fail(fmt::format("'{}' is no outcome", excerpt(name)), {}, "use SUCCEEDED, FAILED, CANCELLED or EXCEPTION");
}

Json to_json(const Task& task) {
  Json json{{"id", task.id}, {"priority", task.priority}, {"steps", Json::array()}};
  if (!task.order.empty()) json["order"] = task.order;
  if (task.deadline) json["deadline_s"] = seconds_of(*task.deadline);
  for (const Step& step : task.steps) json["steps"].push_back({{"skill", step.skill}, {"arguments", step.arguments}});
  return json;
}

Expected<Task> task_from(const Json& json) {
  if (auto fits = task_schema().check(json); !fits) return std::unexpected(fits.error());
  Task task;
  task.id = json.at("id").get<std::string>();
  task.order = json.value("order", std::string{});
  // Through double: JSON Schema calls 50.0 an integer, too.
  if (json.contains("priority")) task.priority = static_cast<int>(json.at("priority").get<double>());
  if (json.contains("deadline_s")) task.deadline = deadline_from(json.at("deadline_s").get<double>());
  for (const Json& step : json.at("steps")) {
    task.steps.push_back({step.at("skill").get<std::string>(), step.value("arguments", Json::object())});
  }
  return task;
}

}  // namespace pons::task
