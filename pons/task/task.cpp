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

Json json_of_tree(const TreeRequest& tree) {
  Json json{{"inputs", tree.inputs}};
  if (!tree.name.empty()) json["name"] = tree.name;
  if (!tree.xml.empty()) json["xml"] = tree.xml;
  return json;
}

TreeRequest tree_from(const Json& json) {
  return {json.value("name", std::string{}), json.value("xml", std::string{}), json.value("inputs", Json::object())};
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

bool is_id(std::string_view text) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._:-";
  return !text.empty() && text.size() <= 64 && text.find_first_not_of(kAllowed) == text.npos;
}

Json to_json(const Task& task) {
  Json json{{"id", task.id}, {"priority", task.priority}};
  if (!task.order.empty()) json["order"] = task.order;
  if (task.deadline) json["deadline_s"] = seconds_of(*task.deadline);
  for (const Step& step : task.steps) json["steps"].push_back({{"skill", step.skill}, {"arguments", step.arguments}});
  if (task.tree) json["tree"] = json_of_tree(*task.tree);
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
  if (json.contains("steps") == json.contains("tree")) {
    return fail(json.contains("tree") ? "it has both steps and a tree" : "it has neither steps nor a tree", "/",
                "give one of them");
  }
  if (json.contains("tree")) {
    task.tree = tree_from(json.at("tree"));
    if (task.tree->name.empty() && task.tree->xml.empty())
      return fail("the tree has neither a name nor its XML", "/tree", "name one of the world's, or write its XML");
    return task;
  }
  for (const Json& step : json.at("steps")) {
    const bool params = step.contains("params");
    if (params && step.contains("arguments"))
      return fail("it has both arguments and params", fmt::format("/steps/{}", task.steps.size()),
                  "they mean the same: give one of them");
    task.steps.push_back(
        {step.at("skill").get<std::string>(), step.value(params ? "params" : "arguments", Json::object()), params});
  }
  return task;
}

}  // namespace pons::task
