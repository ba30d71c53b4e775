// What a task and an outcome are. Pure data.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pons/core/error.hpp"
#include "pons/core/time.hpp"

namespace pons::task {

using Json = nlohmann::json;

// One step: a skill by name and the arguments its schema describes.
struct Step {
  std::string skill;
  Json arguments = Json::object();
  bool params = false;  // whoever sent it calls them so, and hears of them by that name
};

// A behaviour tree instead of steps: one that the world has, by its name, or one sent along (BehaviorTree.CPP 4 XML).
struct TreeRequest {
  std::string name;              // of `xml`, which of its trees: the main one where this is empty
  std::string xml;               // empty: the world's
  Json inputs = Json::object();  // what its blackboard holds at the beginning

  bool operator==(const TreeRequest&) const = default;
};

// What a brain asks for: {"id":"P000123.2","order":"P000123","priority":50,"deadline_s":12.5,
//   "steps":[{"skill":"pick","arguments":{"object":"P000123"}},…]}
struct Task {
  std::string id;                // 1–64 of A–Z a–z 0–9 - _ . :
  std::string order;             // what it is part of, under which its story is told; likewise, or empty: its id
  int priority = 50;             // 0 … 100, higher first
  std::optional<Time> deadline;  // to the microsecond; of no use after it; the earlier first, priorities being equal
  std::vector<Step> steps;       // run in order; none where there is a tree
  std::optional<TreeRequest> tree = {};
};

// Exactly one a task.
enum class Outcome : std::uint8_t { kSucceeded, kFailed, kCancelled, kException };

[[nodiscard]] std::string_view name(Outcome outcome);
[[nodiscard]] Expected<Outcome> outcome_from(std::string_view name);

// Whether it may be the id of a task, as the schema says.
[[nodiscard]] bool is_id(std::string_view text);

[[nodiscard]] Json to_json(const Task& task);
// Shape and ranges only; which skills exist and what they take, the bridge's review knows.
[[nodiscard]] Expected<Task> task_from(const Json& json);

}  // namespace pons::task
